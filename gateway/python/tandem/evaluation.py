"""Many episodes: played by a Python callable, counted, told."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

from . import _native
from .base import Renderer, Sensors, StateEstimate, settings_json
from .contract.replies import Assistance, Protocol, ResultReply
from .contract.start import TaskList
from .episode import Episode


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

    folder: Path | None
    """Where `results.json` and the episodes lie; None where they were not kept."""

    raw: dict[str, Any]
    """All of it, as `results.json` has it."""


def evaluate(
    policy: Callable[[Episode], object],
    tasks: str | Iterable[str] = "all",
    seeds: int | Iterable[int] = range(10),
    jobs: int = 1,
    *,
    name: str | None = None,
    protocol: Protocol = "agentic",
    assistance: Assistance = "paper",
    out: str | PathLike[str] | None = None,
    record: bool = False,
    progress: Callable[[ResultReply], object] | None = None,
    renderer: Renderer = "auto",
    state_estimate: StateEstimate = "estimator",
    sensors: Sensors = "ideal",
    scene: str | PathLike[str] | None = None,
) -> Evaluation:
    """Plays every seed of every task, and counts what came of it, as `tandem evaluate` does.

    policy: Called with each episode, which has begun; it plays until it is done or the episode has ended. An exception of its
        own ends this episode and no other, and the episode does not count; that the episode has ended is none.
    tasks: A task's id, or several; "all" for every one.
    seeds: A seed, or several.
    jobs: Episodes that run side by side, each on a thread of its own, on which the policy is called. Physics and drawing
        run at the same time; Python code of policies does not.
    name: What results call the policy. None: the callable's own name.
    assistance: How much the policy is told; results say which behind its name.
    out: Folder for the results. What it holds of this policy's name, build and settings is not played again, so give another
        name or folder where the policy has changed. None: nothing is kept.
    record: True: every episode is recorded there.
    progress: Called after each episode with its result.
    """
    listed = _native_tasks(tasks)
    called = name or str(getattr(policy, "__qualname__", type(policy).__qualname__))

    def play(native: _native.Episode, briefing: str) -> None:
        policy(Episode._begun(native, briefing))

    def tell(result: str, now: bool) -> None:
        if progress is not None:
            progress(ResultReply.of(json.loads(result)))

    settings = settings_json(
        assistance=assistance,
        renderer=renderer,
        state_estimate=state_estimate,
        sensors=sensors,
        scene=None if scene is None else Path(scene),
    )
    numbers = [seeds] if isinstance(seeds, int) else list(seeds)

    def run(folder: Path) -> dict[str, Any]:
        answer = _native.evaluate(
            play, called, settings, protocol, listed, numbers, jobs, record, folder, tell if progress else None
        )
        return json.loads(answer)

    if out is not None:
        return _evaluation(run(Path(out)), Path(out))
    with TemporaryDirectory(prefix="tandem-") as folder:
        return _evaluation(run(Path(folder)), None)


def _native_tasks(named: str | Iterable[str]) -> list[str]:
    if named == "all":
        return [task.id for task in tasks().tasks]
    return [named] if isinstance(named, str) else list(named)


def _evaluation(raw: dict[str, Any], folder: Path | None) -> Evaluation:
    def summary(task: dict[str, Any]) -> TaskSummary:
        return TaskSummary(**{name: task.get(name, 0) for name in TaskSummary.__dataclass_fields__})

    return Evaluation(
        tasks={task: summary(counted) for task, counted in raw["tasks"].items()},
        results=tuple(ResultReply.of(episode) for episode in raw["episodes"]),
        notes=tuple(episode["note"] for episode in raw["episodes"]),
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
