"""All of it for one task, on a laptop: demonstrations, data set, policy, evaluations and report."""

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
"""How much demonstrations are disturbed: a policy needs to have seen how it goes on from beside the way."""

SIZE = "160x120"
RATE_HZ = 10

SOONER = {"trash_collection": 2}
"""Tasks whose policies are asked again after so many rows, and not after half a second, since a walk to a small thing goes on
being corrected."""

LONGER = ("trash_collection", "co_carry", "table_align", "move_house", "cart_service", "big_table")
"""Tasks in which robots walk: their demonstrations are longer, and hands have to meet what the last step leaves."""

LONGER_STEPS = 12000

WIDE = 2
"""How many times as far as the benchmark's randomisation things are moved where that shows what a policy sees."""

WIDER = {"handover": 4, "co_pouring": 4, "co_carry": 4}
"""Tasks that one demonstration, replayed blindly, solves too often even then."""


@dataclass(frozen=True)
class Recipe:
    """What is made and played."""

    demonstrations: str = "2000-2249"
    """Seeds of the demonstrations, of which those are kept that succeed."""

    seeds: str = "1-100"
    """Seeds of the evaluations."""

    jobs: int | None = None
    """Worlds side by side, and threads of PyTorch. None: the machine's cores."""


def run_recipe(
    task: str,
    out: str | PathLike[str],
    settings: TrainingSettings,
    recipe: Recipe | None = None,
    *,
    tell: Callable[[str], None] = print,
) -> Path:
    """Makes everything that is not there yet, command by command, and returns the report, which has the folder's other
    policies, too. What was interrupted goes on.

    task: The task's id.
    out: Folder for all of it.
    settings: How the policy is trained.
    recipe: How much.
    tell: Called with each command, and with what training says.
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

    # An episode that does not end with its success shows how hands are drawn back from what they have put down.
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
    """How many times as far as the benchmark's randomisation things are moved in demonstrations, and in a second evaluation."""
    return WIDER.get(task, WIDE)


def execute_rows(task: str) -> int:
    """How many rows of an answer are executed before a policy of this task is asked again."""
    return SOONER.get(task, TrainingSettings.execute_rows)


def training_steps(task: str) -> int:
    """How many steps of training a policy of this task gets."""
    return LONGER_STEPS if task in LONGER else TrainingSettings.steps
