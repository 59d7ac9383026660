"""Networks of a policy with their inputs and outputs: the four designs of the benchmark's study of multi-agent
policies.
"""

from __future__ import annotations

from dataclasses import dataclass

from .settings import Scope, Sharing


@dataclass(frozen=True)
class View:
    """Robots whose images and states a network gets, and robots whose actions it predicts, as indices."""

    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


def views(scope: Scope, sharing: Sharing, robots: int) -> tuple[tuple[View, ...], ...]:
    """Returns the views of each network. A shared network of local scope learns from every robot's view without its
    identity.
    """
    everyone = tuple(range(robots))
    if scope == "global":
        told = (everyone,) if sharing == "shared" else tuple((robot,) for robot in everyone)
        return tuple((View(everyone, outputs),) for outputs in told)
    own = tuple(View((robot,), (robot,)) for robot in everyone)
    return (own,) if sharing == "shared" else tuple((view,) for view in own)
