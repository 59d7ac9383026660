"""An episode as its caller meets it, in this process or on a server."""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from operator import index
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, SupportsIndex, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contract.commands import StopReason
from .contract.replies import CameraCalibration, EndReason, Protocol, RobotState
from .contract.result import ResultReply
from .contract.start import Briefing
from .contract.tools import Tools
from .errors import TandemError

Renderer: TypeAlias = Literal["auto", "cpu", "gpu"]
"""Who draws: a graphics processor, the embedded renderer, or whichever is there."""

StateEstimate: TypeAlias = Literal["estimator", "truth"]
"""Where robots have their own state from: an estimator over what they sense, or the simulator."""

Sensors: TypeAlias = Literal["ideal", "g1"]
"""What robots sense: everything exactly, or with noise, bias and latency as a G1 does."""

StressAxis: TypeAlias = Literal[
    "camera", "light", "texture", "layout", "mass", "friction", "sensors", "latency", "push", "words", "partner"
]
"""What goes wrong in an episode."""

StressLevel: TypeAlias = Literal[1, 2, 3]
"""How much of it."""

Self = TypeVar("Self", bound="BaseEpisode")
T = TypeVar("T")


@dataclass(frozen=True)
class Observation:
    """What robots see and sense at one moment."""

    time_s: float
    """Simulated seconds since the episode began."""

    states: tuple[RobotState, ...]
    """What each robot senses of itself."""

    cameras: tuple[CameraCalibration, ...]
    """The calibration of each robot's camera."""

    rgb: dict[str, NDArray[np.uint8]]
    """By robot: what its camera sees; height by width by red, green, blue (sRGB), from the top left pixel."""

    depth_m: dict[str, NDArray[np.float32]]
    """By robot: distance along the optical axis in metres, height by width, infinite where nothing is; empty where it was
    not asked for.
    """


@dataclass(frozen=True)
class Stepped:
    """What rows of joint targets came to."""

    executed_steps: int
    """Control steps of 20 ms that were executed."""

    stop_reason: StopReason
    """Why no more were."""

    time_s: float
    """Simulated seconds since the episode began."""

    phases: tuple[str, ...]
    """Numbers of the phases reached so far, as "p1", where the episode's assistance tells them."""

    fallen: tuple[bool, ...]
    """By robot, whether it has fallen; empty where the assistance is "paper"."""

    ended: bool
    """Whether the episode has ended."""


class BaseEpisode(Tools):
    """One episode: `start` it, call its tools, and leave it by `finish`, or by the end of a `with` block.

    Frames: poses of wrists and cameras are in the robot's own pelvis frame, x forward, y left, z up. Units are SI: metres,
    radians, seconds, newtons; quaternions are w, x, y, z. A control step is 20 ms; physics stands still between calls.
    """

    task: str
    """The task's id."""

    seed: int | None
    """Decides where the objects stand. None where an evaluation does not tell it, as under the assistance "paper"."""

    protocol: Protocol
    """The rules: "agentic" for agents that think between commands, "benchmark" for learned policies."""

    _briefing: Briefing | None = None

    @abstractmethod
    def start(self) -> Briefing:
        """Makes the world, at the task's beginning, and returns what a policy has to know. Again: begins anew."""

    @property
    def briefing(self) -> Briefing:
        """What the start has told."""
        return begun(self._briefing)

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots, as ("A", "B"); arrays have a row for each, in this order."""
        return tuple(robot.robot for robot in self.briefing.robots)

    @property
    def action_columns(self) -> tuple[str, ...]:
        """Names of the 35 columns of a row for `step`: joint targets in radians, then the base command."""
        return tuple(self.briefing.action_row)

    def explain(self) -> tuple[str, ...]:
        """Says what the next phase still lacks, one sentence each, as the simulator measures it. Empty where phases are not
        told, and after the last. Refused where the assistance is "paper"; results name it as `phase_conditions`.
        """
        following = self.get_status(explain=True).next_phase
        return () if following is None else tuple(following.lacks)

    @property
    @abstractmethod
    def state_columns(self) -> tuple[str, ...]:
        """Names of the columns of `state`, each with its unit."""

    @abstractmethod
    def state(self) -> NDArray[np.float32]:
        """What the robots sense, robots by `state_columns`, as numbers: of 43 joints angle, velocity and torque, then both
        wrists' poses in the pelvis frame, the direction of gravity there, the pelvis in the frame in which the robot
        started, the base command in force, and whether it has fallen (1 or 0). Where the assistance is "paper", without
        velocities, torques, gravity, pelvis and fall. Costs no steps.
        """

    @abstractmethod
    def step(self, rows: ArrayLike) -> Stepped:
        """Sends rows of joint targets and base commands to all robots, one row a control step, as `send_joint_chunk` does.

        rows: Robots by 35 for one step, or robots by steps by 35; at most 25 steps in the agentic protocol, 50 in the
            benchmark protocol. Columns are `action_columns`; targets beyond a limit are moved there.
        """

    @abstractmethod
    def observe(self, robots: Sequence[str] | None = None, *, short: bool | None = None, depth: bool = False) -> Observation:
        """Looks through the robots' head cameras, 320 by 240 pixels, and reads what they sense. Costs no steps.

        robots: Those to look through. None: all of them.
        short: True: without joint angles, velocities and torques.
        depth: True: with depth at every pixel, which only the benchmark protocol allows.
        """

    @abstractmethod
    def close(self) -> ResultReply:
        """Ends the episode, unless it has ended, closes its recording and returns the result."""

    def __enter__(self: Self) -> Self:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


def begun(part: T | None) -> T:
    """What an episode has from its start on."""
    if part is None:
        raise TandemError("the episode has not begun; call start() first, or use it in a `with` block")
    return part


ROW_COLUMNS = 35
"""Columns of a row for `step`."""


def chunk_of(rows: ArrayLike, robots: int) -> NDArray[np.float32]:
    """Rows as robots by steps by columns."""
    given = np.ascontiguousarray(rows, dtype=np.float32)
    array = given[:, np.newaxis, :] if given.ndim == 2 else given
    if array.ndim != 3 or array.shape[0] != robots or array.shape[2] != ROW_COLUMNS:
        raise ValueError(f"rows have the shape {given.shape}; give {robots} robots by 35, or {robots} by steps by 35")
    return array


def integer(value: SupportsIndex, what: str) -> int:
    """A whole number, NumPy's included, as Python's own."""
    try:
        return index(value)
    except TypeError as error:
        raise TypeError(f"{what} is {value!r}; give a whole number") from error


def settings_json(**settings: Any) -> str:
    """Settings that are given, as the native module reads them."""
    given = {name: str(value) if isinstance(value, Path) else value for name, value in settings.items()}
    return json.dumps({name: value for name, value in given.items() if value is not None})


__all__ = [
    "BaseEpisode",
    "EndReason",
    "Observation",
    "Renderer",
    "Sensors",
    "StateEstimate",
    "Stepped",
    "StressAxis",
    "StressLevel",
]
