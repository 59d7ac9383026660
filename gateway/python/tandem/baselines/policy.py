# pyright: basic, reportMissingImports=false
# PyTorch is an extra that is not installed everywhere, and its types are partly unknown.
"""Inference with a trained policy."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from ..errors import TandemError
from ..policy_server import Infer, PolicyServer, serve_policy
from .data import ACTIONS, BASE, CLOCK_S
from .learner import scaled, unscaled
from .maps import key
from .networks import PolicyNetwork, as_seen
from .settings import TrainingSettings
from .training import POLICY_FILE

CONTROL_HZ = 50


VELOCITIES = slice(ACTIONS - BASE, ACTIONS - 1)
"""Columns of a row with the base velocities: forwards, to the left, and turning."""

STILL_M_S = 0.03
STILL_RAD_S = 0.05
"""Thresholds below which base velocities become zero. A regression hardly ever predicts exactly zero, and a robot
that walks however slowly steps with bent knees. Experts command velocities this slow in 0.3 % of walking.
"""


def stood_still(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sets velocities below the thresholds to zero in rows of actions, ... by 35, so that robots stand there."""
    velocities = rows[..., VELOCITIES]
    still = np.hypot(velocities[..., 0], velocities[..., 1]) < STILL_M_S
    still &= np.abs(velocities[..., 2]) < STILL_RAD_S
    velocities[still] = 0.0
    return rows


def load(folder: str | PathLike[str], threads: int | None = None) -> Baseline:
    """Loads the output of `train`. If `threads` is given, PyTorch uses that number of threads from then on."""
    if threads is not None:
        torch.set_num_threads(threads)
    path = Path(folder) / POLICY_FILE
    try:
        return Baseline(torch.load(path, weights_only=True))
    except FileNotFoundError:
        raise TandemError(f"there is no {path}; give the folder of a training run that is whole") from None


class Baseline:
    """A policy that was trained on demonstrations of a task."""

    def __init__(self, trained: dict[str, Any]) -> None:
        about = trained["about"]
        self.settings = TrainingSettings(**about["settings"])
        self.task: str = about["task"]
        self.robots: tuple[str, ...] = tuple(about["robots"])
        objects = len(about["objects"])
        self._answers: dict[tuple[int, ...], tuple[PolicyNetwork, tuple[int, ...], dict[str, Any]]] = {}
        for one in trained["networks"]:
            views = [(tuple(inputs), tuple(outputs)) for inputs, outputs in one["views"]]
            network = PolicyNetwork(self.settings, len(views[0][0]), len(views[0][1]), objects)
            network.load_state_dict(one["weights"])
            network.eval()
            for inputs, outputs in views:
                self._answers[outputs] = (network, inputs, one["scales"])

    def serve(self, host: str = "127.0.0.1", port: int = 0) -> PolicyServer:
        """Starts a server for the policy, and returns at once."""
        if self.settings.scope == "global":
            return serve_policy(self._infer_for(range(len(self.robots))), host=host, port=port)
        own = {robot: self._infer_for([number]) for number, robot in enumerate(self.robots)}
        return serve_policy(own, host=host, port=port)

    def act(self, pictures: NDArray[np.uint8], states: NDArray[np.float32], robots: Sequence[int]) -> NDArray[np.float32]:
        """Returns the actions of robots: rows by robots by 35.

        Args:
            pictures: Image of each of `robots`, height by width by 3.
            states: State of each of them: 43 joint angles, the base command in force and the time since the start over
                20 s.
            robots: Indices of the robots.
        """
        chunks = np.empty((self.settings.chunk_rows, len(robots), 35), np.float32)
        place = {robot: number for number, robot in enumerate(robots)}
        seen = as_seen(torch.from_numpy(pictures))
        sensed = torch.from_numpy(states)
        for outputs, (network, inputs, scales) in self._answers.items():
            if not set(outputs) <= place.keys():
                continue
            shown = [place[robot] for robot in inputs]
            with torch.inference_mode():
                known, _ = network.look(seen[None, shown], scaled(sensed[None, shown], scales["states"]))
                told = stood_still(unscaled(network.act(known), scales["chunks"])[0].numpy())
            for number, robot in enumerate(outputs):
                chunks[:, place[robot]] = told[:, number]
        return chunks

    def _infer_for(self, robots: Sequence[int]) -> Infer:
        names, scope = [self.robots[robot] for robot in robots], self.settings.scope

        def infer(observation: dict[str, Any], memory: dict[str, Any]) -> dict[str, NDArray[np.float32]]:
            pictures = np.stack([observation[key("image", name, scope)] for name in names])
            clocks = [observation[key("moment", name, scope)][1:2] / (CONTROL_HZ * CLOCK_S) for name in names]
            sensed = [observation[key("state", name, scope)] for name in names]
            states = np.concatenate([np.stack(sensed), np.stack(clocks)], axis=1, dtype=np.float32)
            chunks = self.act(pictures, states, robots)
            return {key("actions", name, scope): chunks[:, number] for number, name in enumerate(names)}

        return infer
