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
from .contract.commands import PhaseReached
from .contract.result import ResultReply


@dataclass(frozen=True)
class RecordedCall:
    """A tool call as it was made, and its answer."""

    time_s: float
    """Simulated time at which it was answered."""

    thought_s: float
    """Seconds that the policy had thought by then."""

    tool: str
    """The tool's name."""

    arguments: Any
    """Its arguments, as JSON has them; of operators' commands together, each one's."""

    operator: str | None
    """The robot whose operator made it; None where one policy directed all."""

    reply: Any
    """The reply as JSON has it, without pictures; None where the call was refused."""

    problem: str | None
    """Why it was refused; None where it was not."""


@dataclass(frozen=True)
class Picture:
    """What a camera sees."""

    rgb: NDArray[np.uint8]
    """Height by width by red, green, blue (sRGB), from the top left pixel."""

    depth_m: NDArray[np.float32]
    """Distance along the optical axis in metres, height by width; infinite where nothing is."""


class Recording:
    """An `episode.mcap`, every byte of which is checked. Entry 0 of every array is the state before the first step; entry i
    is that after step i. It holds what no policy is told: places in the world, contacts, falls.

    path: The file, or the folder that it is in.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        given = Path(path)
        self.path = given / "episode.mcap" if given.is_dir() else given
        self._native = _native.Recording.read(self.path)
        self._about: dict[str, Any] = json.loads(self._native.about())

    @property
    def spec(self) -> dict[str, Any]:
        """What made the episode what it is: task, seed, protocol, and every setting."""
        return self._about["spec"]

    @property
    def task(self) -> str:
        """The task's id."""
        named = self.spec["task"]
        # Of a task of a file the specification holds all of the file.
        return named if isinstance(named, str) else named["id"]

    @property
    def seed(self) -> int:
        """The seed."""
        return self.spec["seed"]

    @property
    def build(self) -> str:
        """Which build of Tandem played it."""
        return self._about["build"]

    @cached_property
    def result(self) -> ResultReply | None:
        """What it came to; None where the episode was interrupted."""
        return None if (result := self._about["result"]) is None else ResultReply.of(result)

    @cached_property
    def phases(self) -> tuple[PhaseReached, ...]:
        """The phases that were reached."""
        return tuple(PhaseReached.of(phase) for phase in self._about["phases"])

    @cached_property
    def calls(self) -> tuple[RecordedCall, ...]:
        """The tool calls, in their order."""
        return tuple(RecordedCall(**call) for call in self._about["calls"])

    @property
    def instruction(self) -> str:
        """What is to be done, in the words that a policy of all robots is told."""
        return self._about["instruction"]

    @property
    def instructions(self) -> dict[str, str]:
        """What each robot is to do, in the words that its own policy is told."""
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
        """Names of the cameras that `picture` takes: "third_person", and each robot's own by the robot's name."""
        return tuple(self._about["cameras"])

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the 43 joints, in the order of arrays."""
        return tuple(name.removesuffix("_rad") for name in _native.state_columns()[:43])

    @property
    def action_columns(self) -> tuple[str, ...]:
        """Names of the columns of `actions`."""
        return tuple(_native.action_columns())

    @cached_property
    def _arrays(self) -> dict[str, NDArray[Any]]:
        return cast(dict[str, NDArray[Any]], self._native.arrays())

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Simulated time, steps."""
        return self._arrays["time_s"]

    @property
    def q_rad(self) -> NDArray[np.float32]:
        """Joint angles that robots sense, in radians, steps by robots by 43."""
        return self._arrays["q_rad"]

    @property
    def qd_rad_s(self) -> NDArray[np.float32]:
        """Joint velocities that robots sense, in radians per second, steps by robots by 43."""
        return self._arrays["qd_rad_s"]

    @property
    def torque_n_m(self) -> NDArray[np.float32]:
        """Joint torques that robots sense, in newton metres, steps by robots by 43."""
        return self._arrays["torque_n_m"]

    @property
    def actions(self) -> NDArray[np.float32]:
        """What robots were told for each step, steps by robots by 35: joint targets in radians, then the base command."""
        return self._arrays["actions"]

    @property
    def pelvis_in_world(self) -> NDArray[np.float32]:
        """Poses of the pelves in the world, steps by robots by 7: x, y, z in metres, then w, x, y, z."""
        return self._arrays["pelvis_in_world"]

    @property
    def pelvis_in_start(self) -> NDArray[np.float32]:
        """Poses of the pelves by the robots' own odometry, in the frame in which each started, steps by robots by 7."""
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
        """External force on left and right hand as the robot estimates it, in newtons, turned into the world, steps by
        robots by 2 by 3.
        """
        return self._arrays["hand_force_n"]

    @property
    def fallen(self) -> NDArray[np.bool_]:
        """Who has fallen, steps by robots."""
        return self._arrays["fallen"]

    @property
    def objects_in_world(self) -> NDArray[np.float32]:
        """Poses of the objects in the world, steps by objects by 7: x, y, z in metres, then w, x, y, z."""
        return self._arrays["objects_in_world"]

    @property
    def contact_force_n(self) -> NDArray[np.float32]:
        """Normal forces that hands exert on objects, in newtons, in the world, steps by robots by 2 (left, right) by objects
        by 3 (thumb, fingers, palm) by 3; zero where they do not touch.
        """
        return self._arrays["contact_force_n"]

    @cached_property
    def grips(self) -> NDArray[np.uint8]:
        """How hands grip objects, as the episode is scored, steps by robots by 2 (left, right) by objects: 0 not at all, 1
        touching, 2 holding.
        """
        return self._native.grips()

    @cached_property
    def state_hashes(self) -> tuple[str, ...]:
        """Hash of the whole physical state at every step, 16 hexadecimal digits each."""
        return tuple(self._native.state_hashes())

    def __len__(self) -> int:
        """Entries of the arrays: one more than steps."""
        return len(self.time_s)

    def picture(self, camera: str, step: int, *, size: tuple[int, int] | None = None) -> Picture:
        """Draws what a camera saw.

        camera: One of `cameras`.
        step: Index into the arrays; negative ones count from the end.
        size: Width and height in pixels. None: the camera's own.
        """
        rgb, depth_m = self._native.picture(camera, self._index(step), size)
        return Picture(rgb, depth_m)

    def colours(self, camera: str, step: int, *, size: tuple[int, int] | None = None) -> NDArray[np.uint8]:
        """Draws what a camera saw, without depth, as a policy is shown it that asks for this size: a smaller picture of the
        same shape is the camera's own, scaled.

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
