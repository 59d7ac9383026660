"""Policies that learn a task from demonstrations on a laptop, in plain PyTorch: `python -m tandem.baselines`.

    from tandem.baselines import TrainingSettings, load, train

    train("data/pouring", "runs/pouring/policy", TrainingSettings(steps=3000))
    with load("runs/pouring/policy").serve() as server:
        print(server.url)

There are two kinds, `chunk` and `flow`. Both encode each robot's image with a network of its own, and predict a
second of actions at once. `chunk` predicts one chunk of actions; `flow` samples one from the distribution of the
demonstrations (flow matching). They need PyTorch, pyarrow and PyAV: `pip install 'tandem-sim[baselines]'`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from .settings import PolicyKind, Scope, Sharing, TrainingSettings

if TYPE_CHECKING:
    from .policy import Baseline, load
    from .training import train

__all__ = ["Baseline", "PolicyKind", "Scope", "Sharing", "TrainingSettings", "load", "train"]


def __getattr__(name: str) -> object:
    """Loads a module that needs PyTorch when it is first used."""
    if name in ("Baseline", "load"):
        from . import policy

        return getattr(policy, name)
    if name == "train":
        from .training import train

        return train
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
