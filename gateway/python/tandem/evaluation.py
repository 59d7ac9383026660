"""Evaluation over many episodes: playing with a Python callable, counting and reporting."""

from __future__ import annotations

import json
import sys
import threading
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict

import numpy as np

from . import _native
from .base import Camera, Renderer, Sensors, StateEstimate, StressAxis, StressLevel, integer, settings_json
from .contract.replies import Assistance, Protocol
from .contract.result import ResultReply
from .contract.start import TaskList
from .episode import Episode
from .errors import EpisodeEnded, TandemError

if TYPE_CHECKING:
    from typing_extensions import Unpack


def tasks() -> TaskList:
    """Returns the tasks, their phases and budgets, and the robots' limits."""
    return TaskList.of(json.loads(_native.list_tasks()))


@dataclass(frozen=True)
class TaskSummary:
    """Results of the episodes of one task."""

    episodes: int
    """Number of counted episodes."""

    p1: int
    """Number of them that reached the first phase."""

    p2: int
    """Number of them that reached the second phase."""

    p3: int
    """Number of them that reached the third phase."""

    falls: int
    """Number of robots that fell."""

    mean_env_steps: float
    """Mean number of control steps of 20 ms."""

    policy_failed: int
    """Number of episodes that are not counted because the policy raised an exception."""

    simulator_failed: int
    """Number of episodes that are not counted because the simulator failed."""


@dataclass(frozen=True)
class Evaluation:
    """Results of a policy."""

    tasks: dict[str, TaskSummary]
    """Summaries by task id."""

    results: tuple[ResultReply, ...]
    """Result of every episode, by task, then seed."""

    notes: tuple[str | None, ...]
    """Reason why each episode fell short: what stopped the policy, such as the traceback of an exception, or the
    first phase that was missed. None for a success.
    """

    left_out: tuple[str, ...]
    """Episodes that could not be started, with the reasons. The next evaluation into the same folder plays them."""

    folder: Path | None
    """Folder of `results.json` and the episodes; None if they were not kept."""

    raw: dict[str, Any]
    """Full contents of `results.json`."""


class EvaluationSettings(TypedDict, total=False):
    """Common settings of evaluations, wherever they are played."""

    name: str | None
    """Name of the policy in results; by default the callable's own name."""

    protocol: Protocol
    """Rules of play: "agentic", which is the default, or "benchmark"."""

    assistance: Assistance
    """Information for the policy; results add it to the policy's name. The default is "paper", and "full" for
    `collect`.
    """

    instructions: str | PathLike[str] | None
    """JSON file with instructions in place of the tasks' own; results add it to the policy's name."""

    out: str | PathLike[str] | None
    """Folder for the results of this run only. Without it, nothing is kept.

    Existing results of this policy's name, settings and build are not played again. So give another name or folder
    after a change of the policy. Another run in the folder is left as it is and raises an error.
    """

    overwrite: bool
    """True to delete another run in the folder. By default it is left as it is, and an error describes the
    difference.
    """

    resume_with_new_build: bool
    """True to continue a run of another build of Tandem: its episodes are kept, and only the missing ones are
    played.
    """

    record: bool
    """True to record every episode in the folder."""

    progress: Callable[[ResultReply], object] | None
    """Called after each episode with its result."""

    renderer: Renderer
    """Renderer of images."""

    state_estimate: StateEstimate
    """Source of the robots' own state."""

    sensors: Sensors
    """Sensor model of the robots."""

    camera: Camera
    """Model of the robots' cameras."""

    stress: StressAxis
    """Disturbance in every episode; results add it to the policy's name."""

    level: StressLevel
    """Level of the stress; 1 by default."""

    scene: str | PathLike[str] | None
    """MJCF file of a scene in place of the tasks' own."""
    robot: str | PathLike[str] | None
    """File with a robot in place of the embedded one."""

    task_file: str | PathLike[str] | None
    """TOML file with your own task, which `tasks` may name."""

    seed_key: str | PathLike[str] | None
    """File with your own secret key, as in `--seed-key`. It changes the meaning of seeds, so that no one without it
    can simulate an episode in advance. Results name the key's fingerprint. Without a key, a seed means the same
    everywhere.
    """


Policy: TypeAlias = Callable[[Episode], object] | Literal["expert", "idle"]
"""Player: a callable, which is given each episode after its start, or the name of a built-in player."""


def evaluate(
    policy: Policy,
    tasks: str | Iterable[str] | None = None,
    seeds: int | Iterable[int] = range(10),
    jobs: int = 1,
    **settings: Unpack[EvaluationSettings],
) -> Evaluation:
    """Plays every seed of every task and counts the results, like `tandem evaluate`.

    Args:
        policy: Called with each episode after its start; it plays until it is done or the episode has ended. Its
            exceptions end only the current episode, which is not counted. The first one is printed, and if the first
            three episodes end with the same one, the evaluation ends. The end of an episode is not such an exception.
            "expert" is the task's scripted expert, which sees object poses; "idle" holds still.
        tasks: A task's id, or several; "all" for the benchmark's ten, "tandem+" for that suite. None: "all". With
            `task_file`, name its task, or others.
        seeds: A seed, or several.
        jobs: Number of parallel episodes, each on its own thread, on which the policy is called. Physics and rendering
            run in parallel; Python code of policies does not.
        settings: `name`, `protocol`, `assistance`, `instructions`, `out`, `overwrite`, `resume_with_new_build`,
            `record`, `progress`, `renderer`, `state_estimate`, `sensors`, `camera`, `stress`, `level`, `scene`,
            `robot`, `task_file`, `seed_key`: see `EvaluationSettings`.
    """
    plan = Plan.of(policy, tasks, seeds, settings)
    return plan.evaluated(lambda folder: plan.play(folder, jobs))


def collect(
    tasks: str | Iterable[str] | None = None,
    seeds: int | Iterable[int] = range(10),
    jobs: int = 1,
    **settings: Unpack[EvaluationSettings],
) -> Evaluation:
    """Records demonstrations of the experts, like `tandem collect`, in a folder for each episode. These folders
    are in the folder `episodes` of `out`. By default, `out` is a folder in runs/ that is named after all settings.
    """
    # Both are iterated twice.
    tasks, seeds = task_ids(tasks, settings), seed_list(seeds)
    return evaluate("expert", tasks, seeds, jobs, **demonstrations(tasks, seeds, settings))


def demonstrations(tasks: list[str], seeds: list[int], settings: EvaluationSettings) -> EvaluationSettings:
    """Returns the settings for recording demonstrations."""
    whole: EvaluationSettings = {"assistance": "full", **settings, "record": True}
    if whole.get("out") is None:
        plan = Plan.of("expert", tasks, seeds, whole)
        whole["out"] = _native.demonstrations_folder(plan.world, plan.protocol, plan.tasks, plan.seeds, plan.seed_key)
    return whole


@dataclass(frozen=True)
class Plan:
    """Episodes of an evaluation. Another process can play a part of them."""

    policy: Policy
    name: str
    world: str
    """Settings of episodes as JSON for the native module."""
    protocol: Protocol
    tasks: list[str]
    seeds: list[int]
    record: bool
    existing: Literal["refuse", "resume_with_new_build", "overwrite"] = "refuse"
    """Treatment of another run in the folder."""
    seed_key: Path | None = None
    """File with the key that changes the meaning of seeds."""
    out: Path | None = None
    progress: Callable[[ResultReply], object] | None = None

    @staticmethod
    def of(policy: Policy, tasks: str | Iterable[str] | None, seeds: int | Iterable[int], settings: EvaluationSettings) -> Plan:
        """Creates the plan from an evaluation's arguments."""
        unknown = settings.keys() - EvaluationSettings.__annotations__.keys()
        if unknown:
            have = ", ".join(EvaluationSettings.__annotations__)
            raise TypeError(f"no setting {sorted(unknown)[0]!r} of evaluations; have: {have}")
        name = settings.get("name")
        if not callable(policy):
            if name not in (None, policy):
                raise TandemError(f"results call the player {policy!r} by its own name; leave `name` out")
            name = policy
        out, scene, task_file = settings.get("out"), settings.get("scene"), settings.get("task_file")
        robot, instructions = settings.get("robot"), settings.get("instructions")
        seed_key = settings.get("seed_key")
        return Plan(
            policy=policy,
            name=name or str(getattr(policy, "__qualname__", type(policy).__qualname__)),
            world=settings_json(
                assistance=settings.get("assistance", "paper"),
                renderer=settings.get("renderer", "auto"),
                state_estimate=settings.get("state_estimate", "estimator"),
                sensors=settings.get("sensors", "ideal"),
                camera=settings.get("camera", "ideal"),
                stress=settings.get("stress"),
                level=settings.get("level"),
                scene=None if scene is None else Path(scene),
                robot=None if robot is None else Path(robot),
                task_file=None if task_file is None else [str(Path(task_file))],
                instructions=None if instructions is None else Path(instructions),
            ),
            protocol=settings.get("protocol", "agentic"),
            tasks=task_ids(tasks, settings),
            seeds=seed_list(seeds),
            record=settings.get("record", False),
            existing=_existing(settings),
            seed_key=None if seed_key is None else Path(seed_key),
            out=None if out is None else Path(out),
            progress=settings.get("progress"),
        )

    def part(self, task: str, seed: int) -> Plan:
        """Returns the plan of one episode, for another process."""
        return replace(self, tasks=[task], seeds=[seed], out=None, progress=None)

    def play(self, folder: Path, jobs: int = 1) -> dict[str, Any]:
        """Plays the missing episodes of the folder in this process, and returns the new contents of `results.json`."""
        policy = self.policy
        if isinstance(policy, str):
            return self._run(None, folder, jobs)
        watched = _WatchedPolicy(policy)
        try:
            return self._run(watched.play, folder, jobs)
        except TandemError as error:
            if watched.broken is None:
                raise
            raise TandemError(watched.broken) from error

    def play_elsewhere(self, ask: Elsewhere, folder: Path, jobs: int) -> dict[str, Any]:
        """Does the same as `play`, but `ask` has each of `jobs` parallel episodes played by another process."""
        return self._run(ask, folder, jobs, elsewhere=True)

    def _run(self, play: Callable[..., Any] | None, folder: Path, jobs: int, elsewhere: bool = False) -> dict[str, Any]:
        progress = self.progress

        def tell(result: str, now: bool) -> None:
            if progress is not None:
                progress(ResultReply.of(json.loads(result)))

        answer = _native.evaluate(
            play,
            self.name,
            self.world,
            self.protocol,
            self.tasks,
            self.seeds,
            jobs,
            self.record,
            folder,
            tell if progress else None,
            elsewhere,
            self.existing,
            self.seed_key,
        )
        return json.loads(answer)

    def evaluated(self, play: Callable[[Path], dict[str, Any]]) -> Evaluation:
        """Lets `play` fill the folder of the results, or a temporary one."""
        if self.out is not None:
            return _evaluation(play(self.out), self.out)
        with TemporaryDirectory(prefix="tandem-") as folder:
            return _evaluation(play(Path(folder)), None)


MAX_SEEDS = 100_000

MAX_EQUAL_FAILURES = 3
"""Number of first episodes with the same failure after which no further one is started."""


class _WatchedPolicy:
    """A policy whose first failure is printed at once, and which is not called any more if it cannot play at all."""

    def __init__(self, policy: Callable[[Episode], object]) -> None:
        self._policy = policy
        self._lock = threading.Lock()
        self._failures: list[str] = []
        self._has_played = False
        self.broken: str | None = None
        """Reason why it is not called any more."""

    def play(self, native: _native.Episode, briefing: str) -> None:
        """Lets the policy play an episode."""
        try:
            self._policy(Episode._begun(native, briefing))
        except EpisodeEnded:
            self._has_played = True
            raise
        except Exception as error:
            self._failed(error)
            raise
        self._has_played = True

    def _failed(self, error: Exception) -> None:
        with self._lock:
            if not self._failures:
                traceback.print_exception(error, file=sys.stderr)
            self._failures.append(f"{type(error).__name__}: {error}")
            is_broken = not self._has_played and len(self._failures) >= MAX_EQUAL_FAILURES and len(set(self._failures)) == 1
            if is_broken:
                self.broken = (
                    f"the policy has failed alike in the first {MAX_EQUAL_FAILURES} episodes ({self._failures[0]}); mend it, "
                    "and run the evaluation again: what was played is kept"
                )
        if is_broken:
            # This ends the evaluation before it starts another episode.
            raise KeyboardInterrupt from error


Played: TypeAlias = tuple[Literal[True], tuple[str, list[tuple[str, bytes]]]] | tuple[Literal[False], str]
"""True and an episode as JSON with the files of its recording, or false and the reason why it was not played."""

Elsewhere: TypeAlias = Callable[[str, int, Callable[[], bool]], Played]
"""Plays the episode of a task and a seed; the last argument returns true once the user wants to stop."""


def _existing(settings: EvaluationSettings) -> Literal["refuse", "resume_with_new_build", "overwrite"]:
    overwrite, resume = settings.get("overwrite", False), settings.get("resume_with_new_build", False)
    if overwrite and resume:
        raise TandemError("`overwrite` deletes what `resume_with_new_build` keeps; give one of them")
    return "overwrite" if overwrite else "resume_with_new_build" if resume else "refuse"


def task_ids(named: str | Iterable[str] | None, settings: EvaluationSettings) -> list[str]:
    """Returns the ids of tasks that are named individually, or by their suite."""
    if named is None and settings.get("task_file") is not None:
        raise TandemError("a task file, and no `tasks`; name the file's task by its id, or others")
    if not isinstance(named, str | None):
        return list(named)
    suite = None if named in (None, "all") else named
    return [task.id for task in tasks().tasks if task.suite == suite] or [str(named)]


def seed_list(given: int | Iterable[int]) -> list[int]:
    """Returns one seed, or several, as a list."""
    # NumPy arrays also have `__index__`.
    several = [given] if isinstance(given, int | np.integer) else given
    seeds = [integer(seed, "a seed") for seed in islice(several, MAX_SEEDS + 1)]
    if len(seeds) > MAX_SEEDS:
        raise ValueError(f"there are more than {MAX_SEEDS} seeds; give at most so many to one evaluation")
    return seeds


def _evaluation(raw: dict[str, Any], folder: Path | None) -> Evaluation:
    def summary(task: dict[str, Any]) -> TaskSummary:
        return TaskSummary(**{name: task.get(name, 0) for name in TaskSummary.__dataclass_fields__})

    return Evaluation(
        tasks={task: summary(counted) for task, counted in raw["tasks"].items()},
        results=tuple(ResultReply.of(episode) for episode in raw["episodes"]),
        notes=tuple(episode["note"] for episode in raw["episodes"]),
        left_out=tuple(raw.get("left_out", ())),
        folder=folder,
        raw=raw,
    )


def report(
    folders: str | PathLike[str] | Iterable[str | PathLike[str]],
    *,
    format: Literal["html", "md", "csv", "json", "tex", "episodes.csv", "svg", "times.svg", "episodes.parquet"] = "html",
    out: str | PathLike[str] | None = None,
) -> Path:
    """Writes a report on the results of `evaluate`, `tandem evaluate`, `tandem collect` or servers, and returns its
    path.

    Args:
        folders: One or several; results of one policy are joined.
        format: A self-contained page, Markdown, a line for each rate, all figures, tables for LaTeX, a line for each
            episode, a figure of the rates or of the times of phases, or a row for each episode in Parquet.
        out: File to write. None: report.FORMAT in the first folder.
    """
    several = [folders] if isinstance(folders, str | PathLike) else list(folders)
    paths = [str(Path(folder)) for folder in several]
    path = Path(out) if out is not None else Path(paths[0]) / f"report.{format}"
    _native.write_report(["tandem", "report", *paths, "--format", format, "--out", str(path)])
    return path
