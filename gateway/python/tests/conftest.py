"""Fixtures of several files: a server with a folder for its runs, for all tests of a file."""

from collections.abc import Iterator
from pathlib import Path

import pytest

import tandem


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def server(runs: Path) -> Iterator[tandem.Server]:
    with tandem.serve(runs=runs) as server:
        yield server
