"""Which networks a policy has, what each is shown and tells: the four ways of the benchmark's study of multi-agent design."""

from __future__ import annotations

from dataclasses import dataclass

from .settings import Scope, Sharing


@dataclass(frozen=True)
class View:
    """Whose pictures and states a network is shown, and whose actions it tells, as indices of robots."""

    inputs: tuple[int, ...]
    outputs: tuple[int, ...]


def views(scope: Scope, sharing: Sharing, robots: int) -> tuple[tuple[View, ...], ...]:
    """The views of each network. A shared one of local scope learns from every robot's view, and is not told whose it is."""
    everyone = tuple(range(robots))
    if scope == "global":
        told = (everyone,) if sharing == "shared" else tuple((robot,) for robot in everyone)
        return tuple((View(everyone, outputs),) for outputs in told)
    own = tuple(View((robot,), (robot,)) for robot in everyone)
    return (own,) if sharing == "shared" else tuple((view,) for view in own)
