"""Memory that episodes leave allocated; `tests/peers/environments/memory.py` plays 1,000 of each kind."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "tests/peers/environments/memory.py"


@pytest.mark.skipif(sys.platform != "linux", reason="what a process holds is read from Linux's /proc")
@pytest.mark.parametrize("kind", ["with_pictures", "raising"])
def test_episodes_leave_nothing(kind: str, tmp_path: Path) -> None:
    command = [sys.executable, str(SCRIPT), "--episodes", "50", "--most-growth", "0.1", "--kinds", kind]
    played = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert played.returncode == 0, played.stdout + played.stderr
    assert "50 episodes" in played.stdout
