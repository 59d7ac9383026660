"""Every notebook runs from its first cell to its last, and shows pictures."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.py"))


NAMES = ("agent_by_hand", "first_episode", "policy_trained_and_compared", "record_look_score")

# Additional package of a notebook, and the extra that contains it.
FURTHER = {"policy_trained_and_compared": (("av", "pyarrow", "torch"), "baselines")}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run(path: Path, tmp_path: Path) -> None:
    for needed in ("ipykernel", "jupytext", "matplotlib", "nbclient"):
        pytest.importorskip(needed, reason=f"{needed} is not installed: pip install './gateway/python[notebook]'")
    further, extra = FURTHER.get(path.stem, ((), ""))
    for needed in further:
        pytest.importorskip(needed, reason=f"{needed} is not installed: pip install './gateway/python[{extra}]'")
    jupytext: Any = import_module("jupytext")
    nbclient: Any = import_module("nbclient")
    notebook = jupytext.read(path)
    # An exception in a cell is raised here, with the cell and its traceback.
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 2
    (tmp_path / "out").mkdir()
    jupytext.write(notebook, tmp_path / f"out/{path.stem}.ipynb")


def test_there_are_notebooks() -> None:
    assert [path.stem for path in NOTEBOOKS] == list(NAMES)
