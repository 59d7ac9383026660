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
    """Frame of `middle_m` and `axis`: "level", the robot's pelvis frame, but upright; after a walk that of its
    places.
    """

    middle_m: tuple[float, float, float]
    """Middle of the object, [x, y, z] in metres."""

    axis: tuple[float, float, float]
    """Direction of its own z axis, length 1: [0, 0, 1] when it is upright."""

    lowest_m: float
    """Height of its lowest point above the floor, in metres."""


@dataclass(frozen=True, kw_only=True)
class PlanReply(Reply):
    """The reply to `send_plan` and `walk_to`."""

    commands: int
    """Commands that were carried out: of a plan, those that it lists; of a walk, each short one."""

    tool_calls: int | None = None
    """Tool calls of all robots up to now, as results count them: each command of a plan or walk is one, and each
    slice of 5 steps with `until`. No budget limits them. Left out of a short reply.
    """

    executed_steps: int
    """Control steps of 20 ms that they took together."""

    stopped: str | None = None
    """Why no more were; null where all was done."""

    outcomes: tuple[str, ...] = ()
    """A line for each command of a plan that was begun: its steps, and where that left the robots. Left out where
    there is one command.
    """

    held: tuple[HeldObject, ...] = ()
    """Objects in hands after a walk with `carry`, in its frame; left out otherwise."""

    last: CommandReply
    """The reply to the last command that was carried out."""
