"""Columns of a data set's rows.

A row is a moment: the robots' sensed state at that time, and their commands until the next row. Columns whose names
begin with `privileged` are not available to policies; LeRobot's policies only read `observation` and `action`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..recording import Recording
from ..rows import ACTION, EGOCENTRIC, IMAGES, RATES_HZ, STATE, RowContract
from .settings import DEPTH, THIRD_PERSON, ExportSettings

PRIVILEGED = "privileged."

POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
AXES = ("x", "y", "z")
HANDS = ("left", "right")
PARTS = ("thumb", "fingers", "palm")
BASE_VELOCITIES = ("vx_m_s", "vy_m_s", "yaw_rate_rad_s")


@dataclass(frozen=True)
class Column:
    """Values of all rows: rows by names, or one number per row without names."""

    values: NDArray[Any]
    names: tuple[str, ...] | None

    def feature(self) -> dict[str, Any]:
        """Returns the column in the form of `meta/info.json`."""
        names = None if self.names is None else list(self.names)
        return {"dtype": str(self.values.dtype), "shape": [1 if names is None else len(names)], "names": names}


@dataclass(frozen=True)
class View:
    """Part of a recording that becomes one episode of a data set."""

    robots: tuple[int, ...]
    """Indices of the robots whose columns it has."""

    name: str | None
    """Name of the robot in an episode of a single one, else None."""

    task: str
    """Instruction of the episode."""

    cameras: dict[str, str]
    """Names of its image columns, and their cameras."""


def views(recording: Recording, settings: ExportSettings) -> tuple[View, ...]:
    """Returns the episodes that a recording becomes."""
    robots, cameras = recording.robots, settings.cameras_of(recording.robots)
    if settings.view == "joint":
        named = {IMAGES + camera: camera for camera in cameras}
        return (View(tuple(range(len(robots))), None, recording.instruction, named),)
    return tuple(
        View(
            (index,),
            robot,
            recording.instructions[robot],
            {
                IMAGES + (camera if camera == THIRD_PERSON else EGOCENTRIC): camera
                for camera in cameras
                if camera in (robot, THIRD_PERSON)
            },
        )
        for index, robot in enumerate(robots)
    )


def contract_of(recording: Recording, view: View, settings: ExportSettings) -> RowContract:
    """Returns the contract of an episode's rows."""
    robots = None if view.name is not None else [recording.robots[index] for index in view.robots]
    images = {key.removeprefix(IMAGES): settings.size for key in view.cameras}
    images |= {f"{name}{DEPTH}": size for name, size in images.items() if settings.depth}
    return RowContract.of_recording(recording, robots, settings.rate_hz, images)


def moments(recording: Recording, settings: ExportSettings) -> NDArray[np.int64]:
    """Returns the steps of the rows: every `stride`-th one that a command follows."""
    return np.arange(0, len(recording) - 1, settings.stride)


def told(recording: Recording, rows: NDArray[np.int64], stride: int) -> NDArray[np.float32]:
    """Returns the action of each row, in the meaning of a policy map's chunk at this rate. Joint targets and the
    pelvis height are those for the beginning of the next row, and the base velocity is the mean until then.
    """
    last = len(recording) - 1
    actions = recording.actions[np.minimum(rows + stride, last)]
    base = [recording.action_columns.index(name) for name in BASE_VELOCITIES]
    steps = np.minimum(rows[:, None] + np.arange(1, stride + 1), last)
    actions[..., base] = recording.actions[..., base][steps].mean(axis=1)
    return actions


def _setpoints(recording: Recording, robots: list[str], rows: NDArray[np.int64]) -> dict[str, NDArray[np.float32]]:
    """Returns the setpoints of the motors of driven robots in the step after each row; 0 where nobody drives them."""
    steps = np.minimum(rows + 1, len(recording) - 1)
    driven = recording.motor_setpoints
    return {robot: np.nan_to_num(driven[robot][steps], nan=0.0) for robot in robots if robot in driven}


def columns(recording: Recording, view: View, contract: RowContract, rows: NDArray[np.int64]) -> dict[str, Column]:
    """Returns the columns of an episode, except its images."""
    stride = RATES_HZ[0] // contract.rate_hz
    robots = [recording.robots[index] for index in view.robots]

    def of_contract(key: str, values: NDArray[np.float32]) -> Column:
        chosen = np.reshape(values[:, list(view.robots)], (len(rows), -1))
        return Column(np.ascontiguousarray(chosen), contract.features[key])

    def of_robots(values: NDArray[Any], *parts: tuple[str, ...]) -> Column:
        """Returns a column of robots by parts, flattened."""
        names = [() if view.name is not None else (robot,) for robot in robots]
        for part in parts:
            names = [(*name, word) for name in names for word in part]
        chosen = np.reshape(values[:, list(view.robots)], (len(rows), -1))
        return Column(np.ascontiguousarray(chosen), tuple(".".join(name) for name in names))

    def of_objects(values: NDArray[Any], *parts: tuple[str, ...]) -> Column:
        names = [(name,) for name in recording.objects]
        for part in parts:
            names = [(*name, word) for name in names for word in part]
        return Column(np.ascontiguousarray(np.reshape(values, (len(rows), -1))), tuple(".".join(name) for name in names))

    setpoints = {
        f"motor_setpoints{'' if view.name is not None else '.' + robot}": Column(
            np.ascontiguousarray(np.reshape(values, (len(rows), -1))),
            recording.setpoint_columns,
        )
        for robot, values in _setpoints(recording, robots, rows).items()
    }
    objects = recording.objects
    reached_s = [phase.time_s for phase in recording.phases]
    time_s = recording.time_s[rows]
    # A phase counts as reached in the step that reaches it.
    phases = np.searchsorted(np.asarray(reached_s), time_s + 1e-6, side="right").astype(np.int64)
    success = np.full(len(rows), is_successful(recording))
    of_joints = {"velocity_rad_s": recording.qd_rad_s, "torque_n_m": recording.torque_n_m}
    wrists = [index for index, joint in enumerate(recording.joints) if "_wrist_" in joint]
    wrist_joints = tuple(recording.joints[index] for index in wrists)
    return {
        STATE: of_contract(STATE, recording.states[rows]),
        ACTION: of_contract(ACTION, told(recording, rows, stride)),
        **setpoints,
        **{f"{PRIVILEGED}joint_{name}": of_robots(values[rows], recording.joints) for name, values in of_joints.items()},
        f"{PRIVILEGED}pelvis_in_world": of_robots(recording.pelvis_in_world[rows], POSE),
        f"{PRIVILEGED}wrists_in_world": of_robots(recording.wrists_in_world[rows], HANDS, POSE),
        f"{PRIVILEGED}wrist_force_n": of_robots(recording.hand_force_n[rows], HANDS, AXES),
        f"{PRIVILEGED}wrist_torque_n_m": of_robots(recording.torque_n_m[rows][..., wrists], wrist_joints),
        f"{PRIVILEGED}contact_force_n": of_robots(recording.contact_force_n[rows], HANDS, objects, PARTS, AXES),
        f"{PRIVILEGED}grips": of_robots(recording.grips[rows].astype(np.int64), HANDS, objects),
        f"{PRIVILEGED}objects_in_world": of_objects(recording.objects_in_world[rows], POSE),
        f"{PRIVILEGED}fallen": of_robots(recording.fallen[rows], ("fallen",)),
        f"{PRIVILEGED}phases_reached": Column(phases, None),
        f"{PRIVILEGED}success": Column(success, None),
    }


def is_successful(recording: Recording) -> bool:
    """Returns true if the last phase was reached."""
    result = recording.result
    return result is not None and all(time_s is not None for time_s in result.phases.values())
