"""Episodes in this process, at the simulator's own speed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._native import Snapshot
from .base import (
    BaseEpisode,
    Camera,
    Observation,
    Renderer,
    Sensors,
    StateEstimate,
    Stepped,
    StressAxis,
    StressLevel,
    begun,
    chunk_of,
    integer,
    settings_json,
)
from .contract.arguments import Json
from .contract.commands import StopReason
from .contract.replies import Assistance, CameraCalibration, EndReason, Protocol, RobotState
from .contract.result import ResultReply
from .contract.start import Briefing
from .errors import TandemError


class Episode(BaseEpisode):
    """One episode in this process. Python's other threads run during physics and rendering.

    Args:
        task: Id of a task, for example "handover"; `tandem.tasks()` lists them.
        seed: Seed of the objects' poses: 0 to 4294967295.
        protocol: Rules of play: "agentic" for agents that think between commands, "benchmark" for learned policies.
        assistance: Information for the policy: "full" with all sensor values, phases as they are reached and hints on
            grasping; "paper" as in the benchmark.
        record: Folder for `episode.mcap`, `result.json`, `strip.png` and `report.html`. None: nothing is written.
        renderer: Renderer of images.
        state_estimate: Source of the robots' own state.
        sensors: Sensor model of the robots.
        camera: Model of the robots' cameras.
        stress: Disturbance; results name it.
        level: Level of the stress; 1 by default.
        scene: MJCF file of a scene in place of the task's own.
        robot: File with a robot in place of the embedded one.
        task_file: TOML file with your own task, whose id `task` is.
    """

    def __init__(
        self,
        task: str,
        seed: int = 0,
        *,
        protocol: Protocol = "agentic",
        assistance: Assistance = "full",
        record: str | PathLike[str] | None = None,
        renderer: Renderer = "auto",
        state_estimate: StateEstimate = "estimator",
        sensors: Sensors = "ideal",
        camera: Camera = "ideal",
        stress: StressAxis | None = None,
        level: StressLevel | None = None,
        scene: str | PathLike[str] | None = None,
        robot: str | PathLike[str] | None = None,
        task_file: str | PathLike[str] | None = None,
    ) -> None:
        self.task = task
        self.seed = integer(seed, "the seed")
        self.protocol = protocol
        self._record = None if record is None else Path(record)
        self._settings = settings_json(
            assistance=assistance,
            renderer=renderer,
            state_estimate=state_estimate,
            sensors=sensors,
            camera=camera,
            stress=stress,
            level=level,
            scene=None if scene is None else Path(scene),
            robot=None if robot is None else Path(robot),
            task_file=None if task_file is None else [str(Path(task_file))],
        )
        self._native: _native.Episode | None = None
        self._columns: tuple[str, ...] | None = None
        self._is_given = False

    @classmethod
    def _begun(cls, native: _native.Episode, briefing: str) -> Episode:
        """Wraps an episode that has been started already."""
        told = Briefing.of(json.loads(briefing))
        status = told.status
        episode = cls(status.task, protocol=status.protocol, assistance=status.assistance)
        episode.seed = status.seed
        episode._native, episode._briefing, episode._is_given = native, told, True
        return episode

    def start(self) -> Briefing:
        if self._is_given:
            raise TandemError("an evaluation has started this episode; play it as it is, and leave its end to the evaluation")
        if self._native is not None:
            self._native.close()
        start = json.dumps({"task": self.task, "seed": self.seed, "protocol": self.protocol})
        self._native, briefing = _native.Episode.start(start, self._settings, self._record)
        self._briefing = Briefing.of(json.loads(briefing))
        self._columns = None
        return self._briefing

    @property
    def _begun_native(self) -> _native.Episode:
        return begun(self._native)

    def call(self, tool: str, arguments: Mapping[str, Json]) -> Any:
        return json.loads(self._begun_native.call(tool, json.dumps(arguments)))

    def observe(self, robots: Sequence[str] | None = None, *, short: bool | None = None, depth: bool = False) -> Observation:
        arguments = {"robots": None if robots is None else list(robots), "short": short}
        text, views = self._begun_native.observe(json.dumps(arguments), depth)
        seen = json.loads(text)
        states = tuple(RobotState.of(state) for state in seen["states"])
        depths = {state.robot: view[1] for state, view in zip(states, views, strict=True)}
        return Observation(
            time_s=seen["time_s"],
            states=states,
            cameras=tuple(CameraCalibration.of(camera) for camera in seen["cameras"]),
            rgb={state.robot: view[0] for state, view in zip(states, views, strict=True)},
            depth_m={robot: depth_m for robot, depth_m in depths.items() if depth_m is not None},
        )

    @property
    def state_columns(self) -> tuple[str, ...]:
        if self._columns is None:
            self._columns = tuple(self._begun_native.state_columns())
        return self._columns

    def state(self) -> NDArray[np.float32]:
        return self._begun_native.state()

    def step(self, rows: ArrayLike) -> Stepped:
        native = self._begun_native
        steps, reason, time_s, phases, fallen, ended = native.step(chunk_of(rows, len(self.briefing.robots)))
        return Stepped(steps, cast(StopReason, reason), time_s, tuple(phases), tuple(fallen), ended)

    def snapshot(self) -> Snapshot:
        """Returns the state of the episode, including the used budget of its policy. Refused for a scored episode."""
        return self._begun_native.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Moves the episode to a snapshot of it, or of another one of the same task, seed and settings. Refused for
        a recorded or scored episode, which only goes forward.
        """
        self._begun_native.restore(snapshot)

    @property
    def state_hash(self) -> str:
        """Hash of 16 hexadecimal digits that is equal for equal physical states of the same build."""
        return self._begun_native.state_hash()

    @property
    def ended(self) -> EndReason | None:
        """Reason why the episode has ended; None while it goes on."""
        return cast(EndReason | None, self._begun_native.ended())

    def close(self) -> ResultReply:
        return ResultReply.of(json.loads(self._begun_native.close()))
