# pyright: basic, reportMissingImports=false
# PyTorch is an extra that is not installed everywhere, and its types are partly unknown.
"""A training run. The same data, settings and number of threads give the same weights, even with interruptions."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import torch

from .. import _native
from ..errors import TandemError
from .data import Demonstrations, read
from .learner import Learner
from .maps import MAP_FILE, map_text
from .settings import TrainingSettings
from .views import views

POLICY_FILE = "policy.pt"
CHECKPOINT_FILE = "checkpoint.pt"
CURVE_FILE = "training.csv"
CURVE_HEADER = "step,processor_s,actions_loss,objects_loss,validation_actions,validation_objects_m"

REPORT_EVERY = 100
VALIDATE_EVERY = 500
"""Number of steps between two validations, and between checkpoints."""


def train(
    data_set: str | PathLike[str],
    out: str | PathLike[str],
    settings: TrainingSettings | None = None,
    *,
    threads: int | None = None,
    device: str = "cpu",
    tell: Callable[[str], None] = print,
) -> Path:
    """Trains a policy and returns its folder with the weights, the policy map for `tandem evaluate` and the
    learning curve. An interrupted run continues from its last checkpoint; a complete one is left unchanged.

    Args:
        data_set: Folder from `tandem export lerobot`, of version 3 and view joint.
        out: Folder of the policy.
        settings: Settings that determine the weights, besides data and threads.
        threads: Number of PyTorch threads. None: the number of processors of this process, limited by a container's
            quota.
        device: PyTorch device.
        tell: Called with lines of progress.
    """
    settings, folder = settings or TrainingSettings(), Path(out)
    torch.set_num_threads(threads or min(torch.get_num_threads(), _native.available_processors()))
    demonstrations = read(Path(data_set), settings.chunk_rows, settings.every)
    about = _about(demonstrations, settings)
    if (folder / POLICY_FILE).exists():
        if torch.load(folder / POLICY_FILE, weights_only=True)["about"] != about:
            raise TandemError(f"{folder} holds a policy of other data or settings; give another folder, or remove it")
        tell(f"{folder} is trained already")
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    (folder / MAP_FILE).write_text(map_text(settings, demonstrations.size, demonstrations.rate_hz), encoding="utf-8")
    learners = [
        Learner(demonstrations, of_network, settings, number, device)
        for number, of_network in enumerate(views(settings.scope, settings.sharing, len(demonstrations.robots)))
    ]
    parameters = sum(parameter.numel() for learner in learners for parameter in learner.network.parameters())
    tell(
        f"{demonstrations.task}: {len(demonstrations)} moments, of which {int(demonstrations.validated.sum())} for validation; "
        f"{parameters / 1e6:.2f} million parameters in {len(learners)} network{'s' * (len(learners) > 1)}"
    )
    processor_s = _Run(folder, settings, learners, about, tell).go()
    used = {"parameters": parameters, "processor_s": round(processor_s, 1), "threads": torch.get_num_threads()}
    trained = {"about": about, "used": used, "networks": [learner.trained() for learner in learners]}
    partial = folder / f"{POLICY_FILE}.partial"
    torch.save(trained, partial)
    partial.rename(folder / POLICY_FILE)
    (folder / CHECKPOINT_FILE).unlink(missing_ok=True)
    tell(f"{folder}: {settings.steps} steps, {processor_s:.0f} s of processor time on {used['threads']} threads")
    return folder


def _about(demonstrations: Demonstrations, settings: TrainingSettings) -> dict[str, Any]:
    return {
        "settings": settings.as_json(),
        "task": demonstrations.task,
        "robots": list(demonstrations.robots),
        "objects": list(demonstrations.objects),
        "rate_hz": demonstrations.rate_hz,
        "size": list(demonstrations.size),
        "moments": len(demonstrations),
    }


class _Run:
    """Steps of all networks in turn, with checkpoints and a learning curve."""

    def __init__(
        self,
        folder: Path,
        settings: TrainingSettings,
        learners: Sequence[Learner],
        about: dict[str, Any],
        tell: Callable[[str], None],
    ) -> None:
        self._folder, self._settings, self._learners, self._about, self._tell = folder, settings, learners, about, tell
        self._curve: list[str] = []
        self._step = 0
        self._processor_s = 0.0

    def go(self) -> float:
        """Takes the remaining steps. Returns the processor time of all steps, including those of an interrupted
        run.
        """
        self._resume()
        begin_s = time.process_time() - self._processor_s
        while self._step < self._settings.steps:
            losses = [learner.step(self._step) for learner in self._learners]
            self._step += 1
            self._processor_s = time.process_time() - begin_s
            if self._step % REPORT_EVERY == 0 or self._step == self._settings.steps:
                self._report(losses)
        return self._processor_s

    def _report(self, losses: list[tuple[float, float]]) -> None:
        actions, objects = (sum(parts) / len(parts) for parts in zip(*losses, strict=True))
        line = f"{self._step},{self._processor_s:.1f},{actions:.5f},{objects:.5f}"
        told = f"step {self._step} of {self._settings.steps}, {self._processor_s:.0f} s: "
        told += f"actions {actions:.4f}, objects {objects:.4f}"
        if self._step % VALIDATE_EVERY == 0 or self._step == self._settings.steps:
            found = [learner.validate() for learner in self._learners]
            validated = [sum(parts) / len(parts) for parts in zip(*found, strict=True)]
            line += f",{validated[0]:.5f},{validated[1]:.5f}"
            told += f"; held out: actions {validated[0]:.4f}, objects {validated[1]:.4f} m"
        else:
            line += ",,"
        self._curve.append(line)
        (self._folder / CURVE_FILE).write_text("\n".join([CURVE_HEADER, *self._curve, ""]), encoding="utf-8")
        self._tell(told)
        if self._step % VALIDATE_EVERY == 0:
            self._keep()

    def _keep(self) -> None:
        networks = [learner.checkpoint() for learner in self._learners]
        whole = {"about": self._about, "step": self._step, "processor_s": self._processor_s, "curve": self._curve}
        partial = self._folder / f"{CHECKPOINT_FILE}.partial"
        torch.save(whole | {"networks": networks}, partial)
        partial.rename(self._folder / CHECKPOINT_FILE)

    def _resume(self) -> None:
        path = self._folder / CHECKPOINT_FILE
        if not path.exists():
            return
        kept = torch.load(path, weights_only=True)
        if kept["about"] != self._about:
            raise TandemError(f"{path} is of other data or settings; give another folder, or remove it")
        self._step, self._processor_s, self._curve = kept["step"], kept["processor_s"], kept["curve"]
        for learner, checkpoint in zip(self._learners, kept["networks"], strict=True):
            learner.restore(checkpoint)
        self._tell(f"going on after step {self._step}")
