"""Published velocity policies of a G1: from a robot's state to the setpoints of its motors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

POSITION, VELOCITY, KP, KD, TORQUE = range(5)
"""Rows of setpoints."""

HELD = {"waist_yaw": (250.0, 5.0), "wrist": (40.0, 1.5), "thumb_0": (3.0, 0.1), "hand": (2.0, 0.06), "": (80.0, 3.0)}
"""Gains [N m/rad, N m s/rad] of joints that the policy does not control, by the first part of a name that fits."""

SIDES = ("left", "right")
LEG = ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
STEP_S = 0.02


def both(*parts: str) -> list[str]:
    """Returns the names of joints of both sides, as the policy alternates them."""
    return [f"{side}_{part}_joint" for part in parts for side in SIDES]


OBSERVED = [
    *both("hip_pitch"), "waist_yaw_joint", *both("hip_roll"), "waist_roll_joint", *both("hip_yaw"), "waist_pitch_joint",
    *both("knee", "shoulder_pitch", "ankle_pitch", "shoulder_roll", "ankle_roll", "shoulder_yaw", "elbow"),
    *both("wrist_roll", "wrist_pitch", "wrist_yaw"),
]  # fmt: skip
CONTROLLED = [
    *both("hip_pitch", "hip_roll"), "waist_roll_joint", *both("hip_yaw"), "waist_pitch_joint",
    *both("knee", "ankle_pitch", "ankle_roll"),
]  # fmt: skip
"""Joints in the policy's order, by the description that its publisher ships beside the file."""


@dataclass
class State:
    """Observation of a policy; joints are in the robot's order."""

    quaternion_wxyz: NDArray[np.float64]
    gyro_rad_s: NDArray[np.float64]
    q_rad: NDArray[np.float64]
    qd_rad_s: NDArray[np.float64]


class Policy:
    """A policy with its memory.

    names: The robot's joints, in its own order.
    start_rad: Their angles at the start, which joints that the policy does not control keep.
    """

    def __init__(self, names: list[str], start_rad: NDArray[np.float64]) -> None:
        self.setpoints = np.zeros((5, len(names)))
        self.setpoints[POSITION] = start_rad
        for joint, name in enumerate(names):
            self.setpoints[[KP, KD], joint] = next(gains for part, gains in HELD.items() if part in name)

    def act(self, state: State, velocity: tuple[float, float, float]) -> NDArray[np.float64]:
        """Returns the setpoints of the next 20 ms, 5 by the number of joints, for vx and vy [m/s] and a yaw rate [rad/s]."""
        raise NotImplementedError


class Agile(Policy):
    """AGILE's velocity policy (`agile_g1_velocity_e2e.onnx`): legs and two joints of the waist, with gains of its own."""

    def __init__(self, file: Path, names: list[str], start_rad: NDArray[np.float64]) -> None:
        import onnxruntime

        super().__init__(names, start_rad)
        self._session = onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])
        self._outputs = [output.name for output in self._session.get_outputs()]
        shapes = {value.name: value.shape for value in self._session.get_inputs()}
        remembered = [name for name in shapes if f"{name}_out" in self._outputs]
        self._memory = {name: np.zeros(shapes[name], np.float32) for name in remembered}
        self._observed = [names.index(name) for name in OBSERVED]
        self._controlled = [names.index(name) for name in CONTROLLED]

    def act(self, state: State, velocity: tuple[float, float, float]) -> NDArray[np.float64]:
        row = lambda values: np.array([values], np.float32)  # noqa: E731
        given = {
            "root_link_quat_w": row(state.quaternion_wxyz),
            "root_ang_vel_b": row(state.gyro_rad_s),
            "velocity_commands": row(velocity),
            "joint_pos": row(state.q_rad[self._observed]),
            "joint_vel": row(state.qd_rad_s[self._observed]),
        }
        told = dict(zip(self._outputs, self._session.run(None, {**given, **self._memory}), strict=True))
        self._memory = {name: told[f"{name}_out"] for name in self._memory}
        for block, output in ((POSITION, ""), (KP, "_kp_gains"), (KD, "_kd_gains")):
            self.setpoints[block, self._controlled] = told[f"action_joint_pos{output}"][0]
        return self.setpoints


class UnitreeRl(Policy):
    """The policy that Unitree's `unitree_rl_gym` ships for the legs (`deploy/pre_train/g1/motion.pt`); it always steps."""

    REST_RAD = np.tile([-0.1, 0.0, 0.0, 0.3, -0.2, 0.0], 2)
    GAINS = np.tile([[100, 100, 100, 150, 40, 40], [2, 2, 2, 4, 2, 2]], 2)
    RATE_SCALE, GYRO_SCALE, ACTION_SCALE, PERIOD_S = 0.05, 0.25, 0.25, 0.8
    VELOCITY_SCALES = np.array([2.0, 2.0, 0.25])

    def __init__(self, file: Path, names: list[str], start_rad: NDArray[np.float64]) -> None:
        import torch

        super().__init__(names, start_rad)
        self._torch = torch
        self._network = torch.jit.load(str(file))
        self._legs = [names.index(f"{side}_{joint}_joint") for side in SIDES for joint in LEG]
        self._action = np.zeros(len(self._legs))
        self._steps = 0
        self.setpoints[[KP, KD]] = np.where(np.isin(np.arange(len(names)), self._legs), 0.0, self.setpoints[[KP, KD]])
        self.setpoints[np.ix_([KP, KD], self._legs)] = self.GAINS

    def act(self, state: State, velocity: tuple[float, float, float]) -> NDArray[np.float64]:
        self._steps += 1
        w, x, y, z = state.quaternion_wxyz
        down = [2 * (w * y - x * z), -2 * (z * y + w * x), 2 * (x * x + y * y) - 1]
        turn = 2 * np.pi * (self._steps * STEP_S / self.PERIOD_S % 1.0)
        observed = np.concatenate(
            [
                self.GYRO_SCALE * state.gyro_rad_s,
                down,
                self.VELOCITY_SCALES * velocity,
                state.q_rad[self._legs] - self.REST_RAD,
                self.RATE_SCALE * state.qd_rad_s[self._legs],
                self._action,
                [np.sin(turn), np.cos(turn)],
            ]
        )
        with self._torch.no_grad():
            told = self._network(self._torch.from_numpy(observed[None].astype(np.float32)))
        self._action = told.numpy()[0].astype(np.float64)
        self.setpoints[POSITION, self._legs] = self.REST_RAD + self.ACTION_SCALE * self._action
        return self.setpoints


def policy_of(file: Path, names: list[str], start_rad: NDArray[np.float64]) -> Policy:
    """Returns the policy in a file: AGILE's as ONNX, Unitree's as TorchScript."""
    return (UnitreeRl if file.suffix == ".pt" else Agile)(file, names, start_rad)
