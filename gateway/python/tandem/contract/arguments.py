"""Arguments of tools.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from .commands import PoseFrame

Json: TypeAlias = bool | int | float | str | Sequence["Json"] | Mapping[str, "Json"] | None
"""What JSON can say."""

Numbers: TypeAlias = Sequence[float] | Sequence[Sequence[float]] | NDArray[np.floating[Any] | np.integer[Any]]
"""Numbers in the shape that the description names, as a sequence or as an array."""


def plain(value: Any) -> Any:
    """What JSON has in place of classes and arrays; a field that is None is left out."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain({field.name.rstrip("_"): getattr(value, field.name) for field in fields(value)})
    if isinstance(value, np.ndarray | np.generic):
        return cast(Any, value).tolist()
    if isinstance(value, Mapping):
        named = cast(Mapping[str, Any], value)
        return {name: plain(of) for name, of in named.items() if of is not None}
    if isinstance(value, list | tuple):
        return [plain(item) for item in cast(Sequence[Any], value)]
    return value

Color: TypeAlias = Literal[
    "red",
    "orange",
    "brown",
    "yellow",
    "green",
    "blue",
    "violet",
    "white",
    "grey",
    "black",
]
"""Colour of a surface."""


@dataclass(frozen=True)
class Destination:
    """A place to come to rest at."""

    robot: str
    """The robot, for example "A"."""

    to_m: Numbers
    """[x, y] of the pelvis."""

    heading_rad: float | None = None
    """Final heading, counter-clockwise from the frame's x. None: unchanged."""

    waypoints: Sequence[Waypoint] | None = None
    """Places to pass in order, without a stop. Robots that carry together need equally many."""

    carry: bool | None = None
    """True: to push or carry, wrists keep their places to the robot and their height. Robots that carry in one
    call go together at 0.2 m/s and give way to each other (compliance_n_s_m 250); all stop where one lags or a
    wrist is out of reach.
    """


@dataclass(frozen=True)
class Expectation:
    """Conditions on the robots that the command names, or all after `wait`."""

    arrived: bool | None = None
    """Every wrist with a target has arrived."""

    blocked: bool | None = None
    """A wrist is blocked or out of reach."""

    touching: bool | None = None
    """A hand presses on something."""

    holding: bool | None = None
    """A hand holds something."""

    force_above_n: float | None = None
    """A hand feels more than this, in newtons."""

    force_below_n: float | None = None
    """No hand feels more."""

    phase_reached: str | None = None
    """This phase is reached, for example "p1"."""

    base_stepping: bool | None = None
    """A robot steps or settles."""

    heard: bool | None = None
    """Another operator has spoken since the plan began."""

    heard_from: str | None = None
    """The operator of this robot has."""

    partners_wait: bool | None = None
    """All others wait."""

    any_of: Sequence[Any] | None = None
    """One of these holds, each like `expects`."""


@dataclass(frozen=True)
class JointChunk:
    """One robot's rows."""

    robot: str
    """The robot, for example "A"."""

    rows: Numbers
    """Rows of 35 numbers: joint targets in radians for left_arm 7, right_arm 7, left_hand 7, right_hand 7, waist
    3, then vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m.
    """


@dataclass(frozen=True)
class JointDrives:
    """One robot's rows."""

    robot: str
    """The robot, for example "A"."""

    rows: Numbers
    """Rows of 215 numbers: position_rad 43, velocity_rad_s 43, kp_n_m_rad 43, kd_n_m_s_rad 43, torque_n_m 43, each
    in the joints' order of get_robot_state. Or of 860: four of these, one after another, for the physics steps
    of 5 ms.
    """


@dataclass(frozen=True)
class PixelRegion:
    """Pixels of a rectangle at a stride, beginning at `from`."""

    from_: Numbers
    """Top left [u, v], such as [100, 80]."""

    to: Numbers
    """Bottom right, such as [220, 170]."""

    stride: int
    """10: every tenth pixel across and down. Each is 30 bytes of the reply."""


@dataclass(frozen=True)
class PlannedCommand:
    """One command."""

    tool: str
    """Its tool."""

    arguments: Any
    """Its arguments, without episode_id."""

    expects: Expectation | None = None
    """Conditions after it."""

    until: bool | None = None
    """True: it ends once its `expects` hold, with `arrived`, or `holding` of fingers that move, not before all
    `steps`; else the plan stops then, up to 1500. For move_wrists, walk, wait.
    """


@dataclass(frozen=True)
class SurfaceQuery:
    """Give one of these."""

    pixel: Numbers | None = None
    """A pixel on it: for the patch of its colour and the whole thing."""

    color: Color | None = None
    """Its colour: for the nearest three."""

    object: str | None = None
    """An object of the task: for all that is seen of it; "all": for each object."""


@dataclass(frozen=True)
class WalkMove:
    """Values beyond the briefing's ranges are clamped and reported."""

    robot: str
    """The robot, for example "A"."""

    vx_m_s: float
    """Forward velocity, for example 0.3."""

    vy_m_s: float
    """Velocity to the left."""

    yaw_rate_rad_s: float
    """Turning rate, counter-clockwise from above."""

    pelvis_height_m: float | None = None
    """Height above the floor of a robot that stands. None: unchanged."""

    waist_yaw_rad: float | None = None
    """Waist angle to the left of straight ahead: head and arms turn along, at 1 rad/s. None: unchanged."""

    look_at_m: Numbers | None = None
    """Point [x, y, z] in the pelvis frame to look at: the waist turns and, as far as the picture needs, bends;
    arms go along. In place of waist_yaw_rad.
    """


@dataclass(frozen=True)
class Waypoint:
    """A place to pass within 10 cm."""

    at_m: Numbers
    """[x, y]."""

    heading_rad: float | None = None
    """Heading there. None: unchanged."""


@dataclass(frozen=True)
class WristMove:
    """Wrist poses are of the links `left_wrist_yaw_link` and `right_wrist_yaw_link` in the pelvis frame at the
    start of the command (x forward, y left, z up, metres), and then fixed in the world unless `carried`.
    Fingers point along a wrist's x; the right palm faces along its y, the left palm against it. A hand closes
    on what is 0.12 m along x and 0.055 m before its palm.
    """

    robot: str
    """The robot, for example "A"."""

    left_position_m: Numbers | None = None
    """Left wrist [x, y, z], for example [0.30, 0.20, 0.10]. None: unchanged."""

    left_quaternion_wxyz: Numbers | None = None
    """Left wrist orientation; [1, 0, 0, 0]: fingers forward, palm inwards. None: unchanged."""

    right_position_m: Numbers | None = None
    """Right wrist, for example [0.30, -0.20, 0.10]."""

    right_quaternion_wxyz: Numbers | None = None
    """Right wrist orientation."""

    frame: PoseFrame | None = None
    """Frame of the poses. "level": the pelvis frame, but upright; "start", "room": fixed in the room, for targets
    that are repeated.
    """

    carried: bool | None = None
    """True: targets move with the pelvis, to carry something."""

    keep_waist: bool | None = None
    """True: the waist and so the camera stay; arms alone reach."""

    stand_fast: bool | None = None
    """True: hands stop, "out_of_reach", before the robot would have to step."""

    compliance_n_s_m: float | None = None
    """Hands give way to pulls and pushes forward or back: at 1 m/s under this force in newtons, up to 6 cm. At
    least 50; 250 to carry together.
    """

    side_compliance_n_s_m: float | None = None
    """The same to the sides."""

    turn_compliance_n_m_s_rad: float | None = None
    """The same about the vertical between the wrists: at 1 rad/s under this torque in N m. At least 5."""

    left_fingers_rad: Numbers | None = None
    """Left fingers [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1]: positive angles close
    thumb_1 and thumb_2, negative ones middle and index. None: unchanged.
    """

    right_fingers_rad: Numbers | None = None
    """Right fingers, with opposite signs."""

    vx_m_s: float | None = None
    """Forward velocity during this command."""

    vy_m_s: float | None = None
    """Velocity to the left."""

    yaw_rate_rad_s: float | None = None
    """Turning rate, counter-clockwise from above."""

    pelvis_height_m: float | None = None
    """Height above the floor of a robot that stands. None: unchanged."""
