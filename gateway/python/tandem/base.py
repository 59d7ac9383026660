"""The interface of an episode, in this process or on a server."""

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

Renderer: TypeAlias = Literal["auto", "cpu", "gpu", "path"]
"""Renderer of images: a GPU, the embedded one, path tracing on the CPU, or "auto": a GPU if there is one."""

StateEstimate: TypeAlias = Literal["estimator", "truth"]
"""Source of the robots' own state: an estimator on their sensors, or the simulator."""

Sensors: TypeAlias = Literal["ideal", "g1"]
"""Sensor model of the robots: exact, or with the noise, bias and latency of a G1."""

Camera: TypeAlias = Literal["ideal", "d435i"]
"""Model of the robots' cameras: a pinhole with a perfect sensor, or the G1's own Intel RealSense D435i."""

StressAxis: TypeAlias = Literal[
    "camera", "light", "texture", "layout", "mass", "friction", "sensors", "latency", "push", "words", "partner"
]
"""Disturbance in an episode."""

StressLevel: TypeAlias = Literal[1, 2, 3]
"""Level of the stress."""

Self = TypeVar("Self", bound="BaseEpisode")
T = TypeVar("T")


@dataclass(frozen=True)
class Observation:
    """Images and states of the robots at one moment."""

    time_s: float
    """Simulated seconds since the episode began."""

    states: tuple[RobotState, ...]
    """Sensed state of each robot."""

    cameras: tuple[CameraCalibration, ...]
    """Calibration of each robot's camera."""

    rgb: dict[str, NDArray[np.uint8]]
    """Camera image by robot: height by width by red, green, blue (sRGB), from the top left pixel."""

    depth_m: dict[str, NDArray[np.float32]]
    """Depth image by robot: distance along the optical axis in metres, height by width. It is infinite without a
    surface. Empty if depth was not requested.
    """


@dataclass(frozen=True)
class Stepped:
    """Outcome of rows of joint targets."""

    executed_steps: int
    """Number of executed control steps of 20 ms."""

    stop_reason: StopReason
    """Reason why execution stopped."""

    time_s: float
    """Simulated seconds since the episode began."""

    phases: tuple[str, ...]
    """Numbers of the phases reached up to now, for example "p1", if the episode's assistance includes them."""

    fallen: tuple[bool, ...]
    """True for each robot that has fallen; empty under the assistance "paper"."""

    ended: bool
    """True once the episode has ended."""


class BaseEpisode(Tools):
    """One episode: `start` it, call its tools, and leave it with `finish` or at the end of a `with` block.

    Poses of wrists and cameras are in the robot's own pelvis frame, x forward, y left, z up. Units are SI: metres,
    radians, seconds, newtons; quaternions are w, x, y, z. A control step is 20 ms; physics stands still between
    calls.
    """

    task: str
    """Id of the task."""

    seed: int | None
    """Seed of the objects' poses. None if an evaluation hides it, as under the assistance "paper"."""

    protocol: Protocol
    """Rules of play: "agentic" for agents that think between commands, "benchmark" for learned policies."""

    _briefing: Briefing | None = None

    @abstractmethod
    def start(self) -> Briefing:
        """Creates the world at the beginning of the task and returns the briefing. A repeated call starts over."""

    @property
    def briefing(self) -> Briefing:
        """Briefing from the start."""
        return begun(self._briefing)

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots, for example ("A", "B"); arrays have a row for each, in this order."""
        return tuple(robot.robot for robot in self.briefing.robots)

    @property
    def action_columns(self) -> tuple[str, ...]:
        """Names of the 35 columns of a row for `step`: joint targets in radians, then the base command."""
        return tuple(self.briefing.action_row)

    def explain(self) -> tuple[str, ...]:
        """Returns the unmet conditions of the next phase, one sentence each, as the simulator measures them.

        The result is empty without disclosure of phases, and after the last phase. It is refused under the
        assistance "paper". Results name it as `phase_conditions`.
        """
        following = self.get_status(explain=True).next_phase
        return () if following is None else tuple(following.lacks)

    @property
    @abstractmethod
    def state_columns(self) -> tuple[str, ...]:
        """Names of the columns of `state`, each with its unit."""

    @abstractmethod
    def state(self) -> NDArray[np.float32]:
        """Returns the sensed state as numbers, robots by `state_columns`, without using steps.

        The columns are: angle, velocity and torque of 43 joints; the poses of both wrists in the pelvis frame; the
        direction of gravity there; the pelvis in the frame in which the robot started; the base command in force;
        and 1 if the robot has fallen, else 0. Under the assistance "paper" there are no velocities, torques,
        gravity, pelvis and fall.
        """

    @abstractmethod
    def step(self, rows: ArrayLike) -> Stepped:
        """Sends rows of joint targets and base commands to all robots, one row per control step, as
        `send_joint_chunk` does.

        Args:
            rows: Robots by 35 for one step, or robots by steps by 35; at most 25 steps in the agentic protocol, 50 in
                the benchmark protocol. Columns are `action_columns`; targets beyond a limit are clamped.
        """

    @abstractmethod
    def observe(self, robots: Sequence[str] | None = None, *, short: bool | None = None, depth: bool = False) -> Observation:
        """Returns images of the robots' head cameras, 320 by 240 pixels, and the robots' states, without using
        steps.

        Args:
            robots: Robots to include. None: all of them.
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
    """Returns a part that an episode has from its start on. Raises TandemError before the start."""
    if part is None:
        raise TandemError("the episode has not begun; call start() first, or use it in a `with` block")
    return part


ROW_COLUMNS = 35
"""Number of columns of a row for `step`."""


def chunk_of(rows: ArrayLike, robots: int) -> NDArray[np.float32]:
    """Returns rows as robots by steps by columns."""
    given = np.ascontiguousarray(rows, dtype=np.float32)
    array = given[:, np.newaxis, :] if given.ndim == 2 else given
    if array.ndim != 3 or array.shape[0] != robots or array.shape[2] != ROW_COLUMNS:
        raise ValueError(f"rows have the shape {given.shape}; give {robots} robots by 35, or {robots} by steps by 35")
    return array


def integer(value: SupportsIndex, what: str) -> int:
    """Converts a whole number, including NumPy's, to Python's own type."""
    try:
        return index(value)
    except TypeError as error:
        raise TypeError(f"{what} is {value!r}; give a whole number") from error


def settings_json(**settings: Any) -> str:
    """Returns the given settings as JSON for the native module."""
    given = {name: str(value) if isinstance(value, Path) else value for name, value in settings.items()}
    return json.dumps({name: value for name, value in given.items() if value is not None})


__all__ = [
    "BaseEpisode",
    "Camera",
    "EndReason",
    "Observation",
    "Renderer",
    "Sensors",
    "StateEstimate",
    "Stepped",
    "StressAxis",
    "StressLevel",
]
