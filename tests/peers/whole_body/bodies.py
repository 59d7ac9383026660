"""A robot under setpoints of its motors, here and in MuJoCo."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Protocol

import mujoco
import numpy as np
import tandem
from numpy.typing import NDArray
from policy import KD, KP, POSITION, STEP_S, TORQUE, VELOCITY, State

MUJOCO_STEP_S = 0.001
HERE = Path(__file__).parent
ASSETS = HERE.parents[2] / "sim/assets"
FALLEN_M = 0.4


class Body(Protocol):
    """A robot on an open floor."""

    names: list[str]

    def state(self) -> State: ...

    def step(self, setpoints: NDArray[np.float64]) -> None:
        """Makes one control step of 20 ms."""
        ...

    def place(self) -> tuple[float, float]:
        """Returns the position of the pelvis from its start [m]."""
        ...

    def fallen(self) -> bool: ...

    def close(self) -> None: ...


class TandemBody:
    """Robot A of an episode, over the public calls."""

    def __init__(self, seed: int, **settings: Any) -> None:
        self._episode = tandem.Episode("open_floor", seed=seed, task_file=HERE / "open_floor.toml", **settings)
        self._episode.start()
        self._read()
        self.names = list(self._told["joint_positions_rad"])

    def _read(self) -> None:
        self._told = self._episode.call("get_robot_state", {"robot": "A", "samples": True})

    def state(self) -> State:
        samples, pelvis = self._told["samples"], self._told["pelvis_in_start"]
        return State(
            np.array(pelvis["quaternion_wxyz"]),
            np.array(samples["gyro_rad_s"][-1]),
            np.array(samples["joint_positions_rad"][-1]),
            np.array(samples["joint_velocities_rad_s"][-1]),
        )

    def step(self, setpoints: NDArray[np.float64]) -> None:
        row = setpoints.ravel().tolist()
        self._episode.call("send_joint_drives", {"robots": [{"robot": "A", "rows": [row]}]})
        self._read()

    def place(self) -> tuple[float, float]:
        x_m, y_m, _ = self._told["pelvis_in_start"]["position_m"]
        return x_m, y_m

    def fallen(self) -> bool:
        return bool(self._told["fallen"])

    def close(self) -> None:
        departures = self._episode.close().departures
        assert "control: joint (A)" in departures, departures


class MujocoBody:
    """The same robot's file in MuJoCo with steps of 1 ms, its state without an estimator."""

    def __init__(self) -> None:
        scene = mujoco.MjSpec.from_file(str(ASSETS / "scenes/floor.xml"))
        scene.option.timestep = MUJOCO_STEP_S
        scene.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        robot = mujoco.MjSpec.from_file(str(ASSETS / "robots/g1_dex3/robot.xml"))
        scene.attach(robot, prefix="A_", frame=scene.worldbody.add_frame())
        self._model = scene.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_resetDataKeyframe(self._model, self._data, self._model.key("A_stand").id)
        mujoco.mj_forward(self._model, self._data)
        joints = self._model.actuator_trnid[:, 0]
        self._places, self._rates = self._model.jnt_qposadr[joints], self._model.jnt_dofadr[joints]
        self.names = [self._model.joint(joint).name.removeprefix("A_") for joint in joints]

    def state(self) -> State:
        data = self._data
        return State(data.qpos[3:7], data.qvel[3:6], data.qpos[self._places], data.qvel[self._rates])

    def step(self, setpoints: NDArray[np.float64]) -> None:
        kp, kd = setpoints[KP], setpoints[KD]
        self._model.actuator_gainprm[:, 0] = 1.0
        self._model.actuator_biasprm[:, 1], self._model.actuator_biasprm[:, 2] = -kp, -kd
        self._data.ctrl[:] = kp * setpoints[POSITION] + kd * setpoints[VELOCITY] + setpoints[TORQUE]
        for _ in range(round(STEP_S / MUJOCO_STEP_S)):
            mujoco.mj_step(self._model, self._data)

    def place(self) -> tuple[float, float]:
        x_m, y_m = self._data.qpos[:2].tolist()
        return x_m, y_m

    def fallen(self) -> bool:
        return bool(self._data.qpos[2] < FALLEN_M)

    def close(self) -> None:
        pass


def heading_rad(quaternion_wxyz: NDArray[np.float64]) -> float:
    """Returns the yaw of an orientation."""
    w, x, y, z = quaternion_wxyz.tolist()
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def tilt_rad(quaternion_wxyz: NDArray[np.float64]) -> float:
    """Returns the angle between the body's upward axis and the vertical."""
    _, x, y, _ = quaternion_wxyz.tolist()
    return math.acos(1 - 2 * (x * x + y * y))
