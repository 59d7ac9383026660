"""The whole recipe of a task, on a laptop: demonstrations, data set, policy, evaluations and report."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from .. import _native
from ..errors import TandemError
from .maps import MAP_FILE
from .settings import TrainingSettings

DISTURB = 1.0
"""Level of disturbance of demonstrations, because a policy needs examples of recovery from deviations."""

SIZE = "160x120"
RATE_HZ = 10

SOONER = {"trash_collection": 2}
"""Rows of an answer to execute in tasks that need fewer than the default half second, because a walk to a small
object needs frequent corrections.
"""

LONGER = ("trash_collection", "co_carry", "table_align", "move_house", "cart_service", "big_table")
"""Tasks in which robots walk. Their demonstrations are longer, and hands have to reach objects from the place where
the last step ends.
"""

LONGER_STEPS = 12000

WIDE = 2
"""Range of object poses, as a multiple of the benchmark's, that shows whether a policy uses its images."""

WIDER = {"handover": 4, "co_pouring": 4, "co_carry": 4}
"""Larger ranges for tasks that one demonstration, replayed blindly, solves too often at `WIDE`."""


@dataclass(frozen=True)
class Recipe:
    """Amounts of data, evaluation and parallelism."""

    demonstrations: str = "2000-2249"
    """Seeds of the demonstrations; only successful ones are kept."""

    seeds: str = "1-100"
    """Seeds of the evaluations."""

    jobs: int | None = None
    """Number of parallel worlds and of PyTorch threads. None: the number of cores."""


def run_recipe(
    task: str,
    out: str | PathLike[str],
    settings: TrainingSettings,
    recipe: Recipe | None = None,
    *,
    tell: Callable[[str], None] = print,
) -> Path:
    """Creates all missing parts, command by command, and returns the report, which includes the folder's other
    policies. An interrupted recipe is continued.

    Args:
        task: Id of the task.
        out: Folder for all parts.
        settings: Settings of the training.
        recipe: Amounts of data and evaluation.
        tell: Called with each command, and with the output of the training.
    """
    from .policy import load
    from .training import train

    recipe, folder = recipe or Recipe(), Path(out)
    jobs = recipe.jobs or _native.available_processors()
    name = f"{settings.kind}_{settings.scope}_{settings.sharing}_{settings.seed}"
    demonstrations, data, policy = (folder / part for part in ("demonstrations", "data", name))
    benchmark = ["--protocol", "benchmark", "--tasks", task]
    side_by_side = ["--jobs", str(jobs)]

    def tandem(*arguments: str | Path) -> None:
        words = [str(argument) for argument in arguments]
        tell(shlex.join(["tandem", *words]))
        status = subprocess.run([sys.executable, "-m", "tandem", *words], check=False).returncode
        if status != 0:
            raise TandemError(f"tandem {words[0]} failed, with status {status}; the same command goes on")

    # An episode that does not end on success shows how hands are drawn back from objects that were put down.
    disturbed = ["--disturb", f"{DISTURB:g}", "--disclosure", "end", "--only-successful", "--no-reports"]
    spread = ["--spread", str(wide_spread(task))]
    seeds = ["--seeds", recipe.demonstrations]
    tandem("collect", *benchmark, *spread, *disturbed, *seeds, *side_by_side, "--out", demonstrations)
    pictures = ["--images", "png", "--size", SIZE, "--rate", str(RATE_HZ)]
    tandem("export", "lerobot", demonstrations, data, *pictures, *side_by_side)
    train(data, policy, settings, threads=jobs, tell=tell)
    with load(policy).serve() as server:
        asked = ["--policy", server.url, "--policy-map", policy / MAP_FILE, "--policy-name", name]
        for times in (1, wide_spread(task)):
            played = ["--seeds", recipe.seeds, "--spread", str(times), *side_by_side]
            tandem("evaluate", *asked, *benchmark, *played, "--out", folder / f"{name}_spread_{times}")
    report, evaluated = folder / "report.html", sorted(folder.glob("*_spread_*/results.json"))
    tandem("report", *(results.parent for results in evaluated), "--out", report)
    return report


def wide_spread(task: str) -> int:
    """Returns the range of object poses in demonstrations and in a second evaluation, as a multiple of the
    benchmark's.
    """
    return WIDER.get(task, WIDE)


def execute_rows(task: str) -> int:
    """Returns the number of rows of an answer to execute before a policy of this task is queried again."""
    return SOONER.get(task, TrainingSettings.execute_rows)


def training_steps(task: str) -> int:
    """Returns the number of training steps for a policy of this task."""
    return LONGER_STEPS if task in LONGER else TrainingSettings.steps
