"""The scripted policy of these trials: Tandem's own expert plays an episode, and its commands are sent again, row by row,
by whoever has no eyes for anything else."""

import subprocess
import sys
from pathlib import Path

import tandem

TASK, SEED = "handover", 2003


def rows(folder, program=(sys.executable, "-m", "tandem")):
    """Commands of Handover's expert to both robots at each step: steps by robots by 35."""
    played = ["evaluate", "--policy", "expert", "--tasks", TASK, "--seeds", str(SEED), "--protocol", "benchmark"]
    subprocess.run([*program, *played, "--record", "--out", folder], check=True, stdout=subprocess.DEVNULL)
    # The first row is that before the first step.
    return tandem.Recording(Path(folder) / "episodes" / f"{TASK}-{SEED}").actions[1:]
