"""Recorded episodes as arrays."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from . import _native
from .base import Camera, Renderer
from .contract.commands import PhaseReached
from .contract.result import ResultReply


@dataclass(frozen=True)
class RecordedCall:
    """A tool call and its answer."""

    time_s: float
    """Simulated time of the answer."""

    thought_s: float
    """The policy's thinking time up to then, in seconds."""

    tool: str
    """Name of the tool."""

    arguments: Any
    """Arguments as parsed JSON; for combined commands of operators, those of each."""

    operator: str | None
    """Robot whose operator made it; None if one policy controlled all robots."""

    reply: Any
    """Reply as parsed JSON, without images; None if the call was refused."""

    problem: str | None
    """Reason for a refusal; None without one."""


@dataclass(frozen=True)
class Picture:
    """Image of a camera."""

    rgb: NDArray[np.uint8]
    """Height by width by red, green, blue (sRGB), from the top left pixel."""

    depth_m: NDArray[np.float32]
    """Distance along the optical axis in metres, height by width; infinite without a surface, or where the camera has no
    depth."""


class Recording:
    """An `episode.mcap`, every byte of which is checked. Entry 0 of every array is the state before the first step;
    entry i is that after step i. It includes privileged information: poses in the world, contacts, falls.

    Args:
        path: The file, or its folder.
        renderer: Renderer of its images. None: that of the episode.
        camera: Model of the head cameras in its images. None: that of the episode.
    """

    def __init__(self, path: str | PathLike[str], *, renderer: Renderer | None = None, camera: Camera | None = None) -> None:
        given = Path(path)
        self.path = given / "episode.mcap" if given.is_dir() else given
        """Path of the recording's file."""

        self._native = _native.Recording.read(self.path, renderer, camera)
        self._about: dict[str, Any] = json.loads(self._native.about())

    @property
    def spec(self) -> dict[str, Any]:
        """Specification of the episode: task, seed, protocol, and every setting."""
        return self._about["spec"]

    @property
    def task(self) -> str:
        """Id of the task."""
        named = self.spec["task"]
        # For a task from a file, the specification has the whole file.
        return named if isinstance(named, str) else named["id"]

    @property
    def seed(self) -> int:
        """Seed of the episode."""
        return self.spec["seed"]

    @property
    def build(self) -> str:
        """Build of Tandem that played it."""
        return self._about["build"]

    @cached_property
    def result(self) -> ResultReply | None:
        """Result; None if the episode was interrupted."""
        return None if (result := self._about["result"]) is None else ResultReply.of(result)

    @cached_property
    def phases(self) -> tuple[PhaseReached, ...]:
        """Phases that were reached."""
        return tuple(PhaseReached.of(phase) for phase in self._about["phases"])

    @cached_property
    def calls(self) -> tuple[RecordedCall, ...]:
        """Tool calls, in order."""
        return tuple(RecordedCall(**call) for call in self._about["calls"])

    @property
    def instruction(self) -> str:
        """Joint instruction, in the words for a policy of all robots."""
        return self._about["instruction"]

    @property
    def instructions(self) -> dict[str, str]:
        """Instruction of each robot, in the words for its own policy."""
        return self._about["instructions"]

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots, in the order of arrays."""
        return tuple(self._about["robots"])

    @property
    def objects(self) -> tuple[str, ...]:
        """Names of the objects, in the order of arrays."""
        return tuple(self._about["objects"])

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras for `picture`: "third_person", and each robot's own by the robot's name."""
        return tuple(self._about["cameras"])

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the 43 joints, in the order of arrays."""
        return tuple(name.removesuffix("_rad") for name in _native.state_columns()[:43])

    @property
    def action_columns(self) -> tuple[str, ...]:
        """Names of the columns of `actions`."""
        return tuple(_native.action_columns())

    @property
    def setpoint_columns(self) -> tuple[str, ...]:
        """Names of the numbers of `motor_setpoints` in a step, block by block."""
        return tuple(_native.setpoint_columns())

    @cached_property
    def row_layout(self) -> str:
        """JSON of the names, units and ranges of the columns of a robot's rows; `tandem.rows` reads it."""
        return self._native.row_contract()

    @cached_property
    def _arrays(self) -> dict[str, NDArray[Any]]:
        return cast(dict[str, NDArray[Any]], self._native.arrays())

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Simulated time, steps."""
        return self._arrays["time_s"]

    @property
    def q_rad(self) -> NDArray[np.float32]:
        """Sensed joint angles in radians, steps by robots by 43."""
        return self._arrays["q_rad"]

    @property
    def qd_rad_s(self) -> NDArray[np.float32]:
        """Sensed joint velocities in radians per second, steps by robots by 43."""
        return self._arrays["qd_rad_s"]

    @property
    def torque_n_m(self) -> NDArray[np.float32]:
        """Sensed joint torques in newton metres, steps by robots by 43."""
        return self._arrays["torque_n_m"]

    @property
    def actions(self) -> NDArray[np.float32]:
        """Commands for each step, steps by robots by 35: joint targets in radians, then the base command."""
        return self._arrays["actions"]

    @cached_property
    def motor_setpoints(self) -> dict[str, NDArray[np.float32]]:
        """Setpoints at the end of each step of the robots whose motors were driven by `send_joint_drives`, by robot: steps by
        5 by 43, NaN where the robot's own controller drove it. The blocks are position [rad], velocity [rad/s], kp
        [N m/rad], kd [N m s/rad] and torque [N m].
        """
        found = {robot: self._native.motor_setpoints(robot) for robot in self.robots}
        return {robot: setpoints for robot, setpoints in found.items() if setpoints is not None}

    @property
    def states(self) -> NDArray[np.float32]:
        """Sensed joint angles and the base command in force, steps by robots by 47: the states of rows in data sets
        and environments.
        """
        return self._arrays["states"]

    @property
    def pelvis_in_world(self) -> NDArray[np.float32]:
        """Poses of the pelves in the world, steps by robots by 7: x, y, z in metres, then w, x, y, z."""
        return self._arrays["pelvis_in_world"]

    @property
    def pelvis_in_start(self) -> NDArray[np.float32]:
        """Poses of the pelves by the robots' own odometry, in the frame in which each started, steps by robots by
        7.
        """
        return self._arrays["pelvis_in_start"]

    @property
    def wrists_in_pelvis(self) -> NDArray[np.float32]:
        """Poses of left and right wrist in the pelvis frame, steps by robots by 2 by 7."""
        return self._arrays["wrists_in_pelvis"]

    @property
    def wrists_in_world(self) -> NDArray[np.float32]:
        """Poses of left and right wrist in the world, steps by robots by 2 by 7."""
        return self._arrays["wrists_in_world"]

    @property
    def hand_force_n(self) -> NDArray[np.float32]:
        """External force on left and right hand as the robot estimates it, in newtons, rotated to the world frame:
        steps by robots by 2 by 3.
        """
        return self._arrays["hand_force_n"]

    @property
    def fallen(self) -> NDArray[np.bool_]:
        """True for fallen robots, steps by robots."""
        return self._arrays["fallen"]

    @property
    def objects_in_world(self) -> NDArray[np.float32]:
        """Poses of the objects in the world, steps by objects by 7: x, y, z in metres, then w, x, y, z."""
        return self._arrays["objects_in_world"]

    @property
    def contact_force_n(self) -> NDArray[np.float32]:
        """Normal forces of hands on objects in newtons, in the world frame: steps by robots by 2 (left, right) by
        objects by 3 (thumb, fingers, palm) by 3. Zero without contact.
        """
        return self._arrays["contact_force_n"]

    @cached_property
    def grips(self) -> NDArray[np.uint8]:
        """Grips of hands on objects, as the episode is scored, steps by robots by 2 (left, right) by objects: 0
        none, 1 touching, 2 holding.
        """
        return self._native.grips()

    @cached_property
    def state_hashes(self) -> tuple[str, ...]:
        """Hash of the whole physical state at every step, 16 hexadecimal digits each."""
        return tuple(self._native.state_hashes())

    def __len__(self) -> int:
        """Returns the number of entries of the arrays: one more than steps."""
        return len(self.time_s)

    def picture(self, camera: str, step: int, *, size: tuple[int, int] | None = None) -> Picture:
        """Renders a camera's image.

        Args:
            camera: One of `cameras`.
            step: Index into the arrays; negative ones count from the end.
            size: Width and height in pixels. None: the camera's own.
        """
        rgb, depth_m = self._native.picture(camera, self._index(step), size)
        return Picture(rgb, depth_m)

    def colours(self, camera: str, step: int, *, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
        """Renders a camera's image without depth, as a policy gets it that requests this size. A smaller image with
        the same aspect ratio is scaled from the camera's own.

        Args:
            camera: One of `cameras`.
            step: Index into the arrays; negative ones count from the end.
            size: Width and height in pixels. None: the camera's own.
        """
        return self._native.colours(camera, self._index(step), size)

    def _index(self, step: int) -> int:
        index = step + len(self) if step < 0 else step
        if not 0 <= index < len(self):
            raise IndexError(f"no step {step} in this recording; have 0 to {len(self) - 1}")
        return index
