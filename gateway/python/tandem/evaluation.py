"""Many episodes: played by a Python callable, counted, told."""

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
from .base import Renderer, Sensors, StateEstimate, StressAxis, StressLevel, integer, settings_json
from .contract.replies import Assistance, Protocol
from .contract.result import ResultReply
from .contract.start import TaskList
from .episode import Episode
from .errors import EpisodeEnded, TandemError

if TYPE_CHECKING:
    from typing_extensions import Unpack


def tasks() -> TaskList:
    """The tasks, their phases and budgets, and what robots can do."""
    return TaskList.of(json.loads(_native.list_tasks()))


@dataclass(frozen=True)
class TaskSummary:
    """What the episodes of one task came to."""

    episodes: int
    """Episodes that count."""

    p1: int
    """How many of them reached the first phase."""

    p2: int
    """How many of them reached the second phase."""

    p3: int
    """How many of them reached the third phase."""

    falls: int
    """Robots that fell."""

    mean_env_steps: float
    """Control steps of 20 ms, on average."""

    policy_failed: int
    """Episodes that do not count, because the policy raised an exception."""

    simulator_failed: int
    """Episodes that do not count, because the simulator failed."""


@dataclass(frozen=True)
class Evaluation:
    """What a policy came to."""

    tasks: dict[str, TaskSummary]
    """By the task's id."""

    results: tuple[ResultReply, ...]
    """Every episode's result, by task, then seed."""

    notes: tuple[str | None, ...]
    """By episode, why it fell short: what stopped the policy, as the traceback of an exception, or the first phase that was
    missed; None of a success.
    """

    left_out: tuple[str, ...]
    """Episodes that could not be begun, and why. The next evaluation into the same folder plays them."""

    folder: Path | None
    """Where `results.json` and the episodes lie; None where they were not kept."""

    raw: dict[str, Any]
    """All of it, as `results.json` has it."""


class EvaluationSettings(TypedDict, total=False):
    """What evaluations have in common, wherever they are played."""

    name: str | None
    """What results call the policy; without it, the callable's own name."""

    protocol: Protocol
    """The rules: "agentic", which is the default, or "benchmark"."""

    assistance: Assistance
    """How much the policy is told; results say which behind its name. The default is "paper", for `collect` "full"."""

    instructions: str | PathLike[str] | None
    """JSON file with instructions in place of the tasks' own; results name them behind the policy's name."""

    out: str | PathLike[str] | None
    """Folder for the results, of this run alone: what it holds of this policy's name, settings and build is not played again,
    so give another name or folder where the policy has changed; another run there is left as it is, and an error. Without
    it, nothing is kept.
    """

    overwrite: bool
    """Whether another run that lies there is deleted. It is left as it is otherwise, and an error says what differs."""

    resume_with_new_build: bool
    """Whether the same run of another build of Tandem goes on: what that has played is kept, and only the rest is played."""

    record: bool
    """Whether every episode is recorded there."""

    progress: Callable[[ResultReply], object] | None
    """Called after each episode with its result."""

    renderer: Renderer
    """Who draws."""

    state_estimate: StateEstimate
    """Where robots have their own state from."""

    sensors: Sensors
    """What robots sense."""

    stress: StressAxis
    """What goes wrong in every episode; results name it behind the policy's name."""

    level: StressLevel
    """How much of it; 1 where nothing is said."""

    scene: str | PathLike[str] | None
    """MJCF file of a scene in place of the tasks' own."""
    robot: str | PathLike[str] | None
    """File that describes the robots in place of the embedded one."""

    task_file: str | PathLike[str] | None
    """TOML file with a task of your own, which `tasks` may name."""

    seed_key: str | PathLike[str] | None
    """File with a key of yours, by which what the seeds mean is drawn, as `--seed-key` has it: nobody without it can simulate
    an episode in advance. Results name the key by its fingerprint. Without it, a seed means the same everywhere.
    """


Policy: TypeAlias = Callable[[Episode], object] | Literal["expert", "idle"]
"""Who plays: a callable, which is given each episode as it begins, or a player that Tandem has, by name."""


def evaluate(
    policy: Policy,
    tasks: str | Iterable[str] = "all",
    seeds: int | Iterable[int] = range(10),
    jobs: int = 1,
    **settings: Unpack[EvaluationSettings],
) -> Evaluation:
    """Plays every seed of every task, and counts what came of it, as `tandem evaluate` does.

    policy: Called with each episode, which has begun; it plays until it is done or the episode has ended. An exception of its
        own ends this episode and no other, and the episode does not count; the first one is printed, and where the first three
        episodes end by the same, the evaluation ends. That the episode has ended is no exception. "expert" is
        the task's scripted expert, which sees object poses; "idle" holds still.
    tasks: A task's id, or several; "all" for the benchmark's ten, "tandem+" for that suite.
    seeds: A seed, or several.
    jobs: Episodes that run side by side, each on a thread of its own, on which the policy is called. Physics and drawing
        run at the same time; Python code of policies does not.
    settings: `name`, `protocol`, `assistance`, `instructions`, `out`, `overwrite`, `resume_with_new_build`, `record`,
        `progress`, `renderer`, `state_estimate`, `sensors`, `stress`, `level`, `scene`, `robot`, `task_file`,
        `seed_key`: see `EvaluationSettings`.
    """
    plan = Plan.of(policy, tasks, seeds, settings)
    return plan.evaluated(lambda folder: plan.play(folder, jobs))


def collect(
    tasks: str | Iterable[str] = "all",
    seeds: int | Iterable[int] = range(10),
    jobs: int = 1,
    **settings: Unpack[EvaluationSettings],
) -> Evaluation:
    """Records demonstrations of the experts, as `tandem collect` does: a folder for each episode, in the folder `episodes` of
    `out`, which where nothing else is given is one in runs/, with a name made of all that they are.
    """
    # Both are gone through twice.
    tasks, seeds = task_ids(tasks), seed_list(seeds)
    return evaluate("expert", tasks, seeds, jobs, **demonstrations(tasks, seeds, settings))


def demonstrations(tasks: list[str], seeds: list[int], settings: EvaluationSettings) -> EvaluationSettings:
    """The settings with which demonstrations are recorded."""
    whole: EvaluationSettings = {"assistance": "full", **settings, "record": True}
    if whole.get("out") is None:
        plan = Plan.of("expert", tasks, seeds, whole)
        whole["out"] = _native.demonstrations_folder(plan.world, plan.protocol, plan.tasks, plan.seeds, plan.seed_key)
    return whole


@dataclass(frozen=True)
class Plan:
    """What an evaluation plays. Another process can play a part of it."""

    policy: Policy
    name: str
    world: str
    """Settings of episodes, as the native module reads them."""
    protocol: Protocol
    tasks: list[str]
    seeds: list[int]
    record: bool
    existing: Literal["refuse", "resume_with_new_build", "overwrite"] = "refuse"
    """What becomes of another run in the folder."""
    seed_key: Path | None = None
    """File with the key that draws what the seeds mean."""
    out: Path | None = None
    progress: Callable[[ResultReply], object] | None = None

    @staticmethod
    def of(policy: Policy, tasks: str | Iterable[str], seeds: int | Iterable[int], settings: EvaluationSettings) -> Plan:
        """The plan of an evaluation's arguments."""
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
                stress=settings.get("stress"),
                level=settings.get("level"),
                scene=None if scene is None else Path(scene),
                robot=None if robot is None else Path(robot),
                task_file=None if task_file is None else [str(Path(task_file))],
                instructions=None if instructions is None else Path(instructions),
            ),
            protocol=settings.get("protocol", "agentic"),
            tasks=task_ids(tasks),
            seeds=seed_list(seeds),
            record=settings.get("record", False),
            existing=_existing(settings),
            seed_key=None if seed_key is None else Path(seed_key),
            out=None if out is None else Path(out),
            progress=settings.get("progress"),
        )

    def part(self, task: str, seed: int) -> Plan:
        """One episode of it, for another process."""
        return replace(self, tasks=[task], seeds=[seed], out=None, progress=None)

    def play(self, folder: Path, jobs: int = 1) -> dict[str, Any]:
        """Plays what the folder does not hold, in this process, and returns what `results.json` has then."""
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
        """As `play`, but `ask` has each of `jobs` episodes at once played by another process."""
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
        """Has `play` fill the folder of the results, or one that is not kept."""
        if self.out is not None:
            return _evaluation(play(self.out), self.out)
        with TemporaryDirectory(prefix="tandem-") as folder:
            return _evaluation(play(Path(folder)), None)


MAX_SEEDS = 100_000

MAX_EQUAL_FAILURES = 3
"""First episodes that fail alike, after which no further one is begun."""


class _WatchedPolicy:
    """A policy whose first failure is told at once, and which is not called any more where it cannot play at all."""

    def __init__(self, policy: Callable[[Episode], object]) -> None:
        self._policy = policy
        self._lock = threading.Lock()
        self._failures: list[str] = []
        self._has_played = False
        self.broken: str | None = None
        """Why it is not called any more."""

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
                    f"the policy has failed alike in the first {MAX_EQUAL_FAILURES} episodes ({self._failures[0]}); mend it, and run "
                    "the evaluation again: what was played is kept"
                )
        if is_broken:
            # An evaluation ends by this, and no other episode is begun.
            raise KeyboardInterrupt from error


Played: TypeAlias = tuple[Literal[True], tuple[str, list[tuple[str, bytes]]]] | tuple[Literal[False], str]
"""An episode as JSON with the files of its recording, or why it was not played."""

Elsewhere: TypeAlias = Callable[[str, int, Callable[[], bool]], Played]
"""Has the episode of a task and a seed played; the last argument says whether the user wants all of it to end."""


def _existing(settings: EvaluationSettings) -> Literal["refuse", "resume_with_new_build", "overwrite"]:
    overwrite, resume = settings.get("overwrite", False), settings.get("resume_with_new_build", False)
    if overwrite and resume:
        raise TandemError("`overwrite` deletes what `resume_with_new_build` keeps; give one of them")
    return "overwrite" if overwrite else "resume_with_new_build" if resume else "refuse"


def task_ids(named: str | Iterable[str]) -> list[str]:
    """The ids of tasks that are named one by one, or by their suite."""
    if not isinstance(named, str):
        return list(named)
    suite = None if named == "all" else named
    return [task.id for task in tasks().tasks if task.suite == suite] or [named]


def seed_list(given: int | Iterable[int]) -> list[int]:
    """One seed, or several, as a list."""
    # An array of NumPy's has `__index__`, too.
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
    format: Literal["html", "md", "csv", "json", "tex"] = "html",
    out: str | PathLike[str] | None = None,
) -> Path:
    """Writes a report on what `evaluate`, `tandem evaluate`, `tandem collect` or servers have left, and returns where it is.

    folders: One or several; what they hold of one policy is joined.
    format: A page that needs nothing else, Markdown, a line for each rate, all figures, or tables for LaTeX.
    out: File to write. None: report.FORMAT in the first folder.
    """
    several = [folders] if isinstance(folders, str | PathLike) else list(folders)
    paths = [str(Path(folder)) for folder in several]
    path = Path(out) if out is not None else Path(paths[0]) / f"report.{format}"
    _native.write_report(["tandem", "report", *paths, "--format", format, "--out", str(path)])
    return path
