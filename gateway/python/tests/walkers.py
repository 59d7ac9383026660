"""Policies that processes of a cluster can import."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import tandem


def walk(episode: tandem.Episode) -> None:
    """Walks a little, and further at odd seeds, which it receives."""
    assert episode.seed is not None
    for _ in range(1 + episode.seed % 2):
        episode.walk(10, [tandem.WalkMove("A", 0.2, 0.0, 0.0)])


@dataclass
class NotingWalker:
    """Walks like `walk`, and writes down its node. On the node that is to fail, its first episode lasts until the node is gone.

    The others wait for that one to begin: a node may take longer to start a process than they take for all episodes.
    """

    notes: Path
    doomed: str

    def __call__(self, episode: tandem.Episode) -> None:
        ray: Any = import_module("ray")
        node = ray.get_runtime_context().get_node_id()
        with (self.notes / "begun").open("a") as begun:
            begun.write(f"{episode.seed} {node}\n")
        if node == self.doomed:
            (self.notes / "waiting").touch()
            while True:
                time.sleep(0.1)
        deadline = time.monotonic() + 120
        while not (self.notes / "waiting").exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        walk(episode)


def fail(episode: tandem.Episode) -> None:
    """Waits. At two seeds it ends its process, or raises an exception."""
    if episode.seed == 2021:
        os._exit(1)
    if episode.seed == 2022:
        raise ValueError("no plan for this seed")
    episode.wait(5)
