"""Replies to plans and walks.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass

from .commands import CommandReply, PoseFrame
from .reading import Reply


@dataclass(frozen=True, kw_only=True)
class HeldObject(Reply):
    """An object in a hand."""

    robot: str
    """The robot, for example "A"."""

    hand: str
    """`left` or `right`."""

    object: str
    """The object."""

    frame: PoseFrame
    """Frame of `middle_m` and `axis`: "level", the upright pelvis frame; after `walk_to`, the frame of its
    targets.
    """

    middle_m: tuple[float, float, float]
    """Middle of the object, [x, y, z] in metres."""

    axis: tuple[float, float, float]
    """Unit vector along its z axis: [0, 0, 1] if upright."""

    lowest_m: float
    """Height of its lowest point above the floor, in metres."""


@dataclass(frozen=True, kw_only=True)
class PlanReply(Reply):
    """The reply to `send_plan` and `walk_to`."""

    commands: int
    """Executed commands: those listed in a plan, or the short ones of a walk."""

    tool_calls: int | None = None
    """Tool calls of all robots up to now, as results count them: each command of a plan or walk is one, and each
    slice of 5 steps with `until`. No budget limits them. Left out of a short reply.
    """

    executed_steps: int
    """Control steps of 20 ms of these commands."""

    stopped: str | None = None
    """Cause of an early stop; null if none."""

    outcomes: tuple[str, ...] = ()
    """A line for each started command of a plan: its steps, and the robots' state after them. Left out for a
    single command.
    """

    held: tuple[HeldObject, ...] = ()
    """Objects in hands after a walk with `carry`, in its frame; left out otherwise."""

    last: CommandReply
    """The reply to the last executed command."""
