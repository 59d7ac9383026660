"""Small runs of the examples for learners."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples/environments"


def test_a_hand_begins_to_learn(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3", reason=f"pip install -r {EXAMPLES}/reach_and_grasp.txt")
    small = ["--decisions=256", "--worlds=2", f"--out={tmp_path}"]
    command = [sys.executable, str(EXAMPLES / "reach_and_grasp.py"), *small]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "of 12 unseen episodes" in done.stdout
    with (tmp_path / "curve.csv").open() as file:
        rollouts = list(csv.DictReader(file))
    assert [row["decisions"] for row in rollouts] == ["128", "256"]
    # Episodes have the configured length, and only the first phase is rewarded.
    assert all(int(row["episodes"]) >= 6 and float(row["mean_return"]) <= 1 for row in rollouts)
