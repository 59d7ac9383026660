"""What tools are given.

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
    "yellow",
    "green",
    "blue",
    "purple",
    "white",
    "grey",
    "black",
]


@dataclass(frozen=True)
class Destination:
    """Where one robot's pelvis is to come to rest."""

    robot: str
    """The robot, as "A"."""

    to_m: Numbers
    """[x, y] in metres in the robot's own start frame, as pelvis_in_start has it."""

    heading_rad: float | None = None
    """Which way it is to face, in radians counter-clockwise from how it faced at the start. None: as it faces now,
    or at the last waypoint.
    """

    waypoints: Sequence[Waypoint] | None = None
    """Places to go by on the way, in order, without a stop. Robots of one call that carry have as many waypoints
    as each other, and go by them together. None: none.
    """

    carry: bool | None = None
    """True: it pushes or carries what its hands hold. Wrists stay where they are to it and as high over the floor
    though its pelvis sinks as it walks, and lead it by what it lags. Robots of one call that carry go at one
    pace of 0.2 m/s and give way to each other (compliance_n_s_m 250), so that several carry one load: give each
    its place in its own start frame. All slow down and stop where one lags by 18 cm, is turned away by 0.2 rad,
    or a wrist is out of reach. None: false.
    """


@dataclass(frozen=True)
class Expectation:
    """What is expected of the robots that a command named, or of all after `wait`, once it is done. What is null
    is not looked at.
    """

    arrived: bool | None = None
    """Whether every wrist that has a target has arrived there."""

    blocked: bool | None = None
    """Whether a wrist is blocked or out of reach."""

    force_above_n: float | None = None
    """That a hand feels more than as many newtons."""

    force_below_n: float | None = None
    """That no hand feels more than as many newtons."""

    phase_reached: str | None = None
    """That this phase has been reached, as "p1"."""

    base_stepping: bool | None = None
    """Whether a robot steps, or settles after it was told to walk."""


@dataclass(frozen=True)
class JointChunk:
    """The rows of one robot."""

    robot: str
    """The robot, as "A"."""

    rows: Numbers
    """Rows of 35 numbers each, as many as every other robot has. A row: joint targets in radians for left_arm 7,
    right_arm 7, left_hand 7, right_hand 7, waist 3 (yaw, roll, pitch), then the base command: vx_m_s, vy_m_s,
    yaw_rate_rad_s, pelvis_height_m. An arm is shoulder_pitch, shoulder_roll, shoulder_yaw, elbow, wrist_roll,
    wrist_pitch, wrist_yaw; a hand is thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1.
    """


@dataclass(frozen=True)
class PixelRegion:
    """Every so many pixels of a rectangle, beginning at `from`."""

    from_: Numbers
    """Its top left pixel [u, v], as [100, 80]."""

    to: Numbers
    """Its bottom right pixel [u, v], as [220, 170]."""

    stride: int
    """1 for every pixel, 10 for every tenth one across and down."""


@dataclass(frozen=True)
class PlannedCommand:
    """One command of a plan."""

    tool: str
    """"move_wrists", "walk", "wait" or "send_joint_chunk"."""

    arguments: Any
    """The arguments of that tool, without episode_id."""

    expects: Expectation | None = None
    """What has to be so afterwards for the plan to go on. None: nothing."""


@dataclass(frozen=True)
class SurfaceQuery:
    """A surface in a picture: what is joined to a pixel, or the nearest of a colour."""

    pixel: Numbers | None = None
    """A pixel on it, as [160, 120]. None: the nearest of `color`."""

    color: Color | None = None
    """Its colour. None: that of `pixel`."""


@dataclass(frozen=True)
class WalkMove:
    """What one robot's base is to do. start_episode names the range of each field; values beyond it are clamped
    and reported.
    """

    robot: str
    """The robot, as "A"."""

    vx_m_s: float
    """Forward velocity in metres per second, as 0.3."""

    vy_m_s: float
    """Velocity to the left in metres per second."""

    yaw_rate_rad_s: float
    """Turning rate in radians per second, counter-clockwise seen from above."""

    pelvis_height_m: float | None = None
    """Height of the pelvis above the floor in metres, for a robot that stands; while it steps it may be lower.
    None: the target stays.
    """

    waist_yaw_rad: float | None = None
    """Where the waist is to turn, in radians to the left, at 1 rad/s at most: head and arms turn with it. 0 is
    straight ahead. None: it stays.
    """

    look_at_m: Numbers | None = None
    """A point to turn the head to by the waist, [x, y, z] in the pelvis frame, in place of waist_yaw_rad. None:
    none.
    """


@dataclass(frozen=True)
class Waypoint:
    """A place that a robot's pelvis is to go by, within 10 cm or so."""

    at_m: Numbers
    """[x, y] in metres in the robot's own start frame."""

    heading_rad: float | None = None
    """Which way it is to face there, as the place's. None: as before."""


@dataclass(frozen=True)
class WristMove:
    """What one robot is to do. Wrist poses are of the links `left_wrist_yaw_link` and `right_wrist_yaw_link` in
    the robot's own pelvis frame as it is when the command begins: x forward, y left, z up, metres. From then on
    they are fixed in the world: a robot that walks or sways does not take its hands along, unless `carried` is
    true. The fingers point along a wrist's x axis; the right palm faces along its y axis, the left palm against
    it, so that with [1, 0, 0, 0] the fingers point forward and the palms face each other. A hand closes on what
    lies 0.12 m along x and 0.055 m before its palm. To grasp an upright bottle from the side with [1, 0, 0, 0],
    open the thumb, bring the right wrist to [-0.12, -0.135, 0] from the bottle's axis, then to [-0.12, -0.055,
    0], palm first, then close the fingers.
    """

    robot: str
    """The robot, as "A"."""

    left_position_m: Numbers | None = None
    """Left wrist position [x, y, z] in metres, as [0.30, 0.20, 0.10]. None: it stays where it is to be; without an
    orientation either, the arm keeps its joints.
    """

    left_quaternion_wxyz: Numbers | None = None
    """Left wrist orientation [w, x, y, z], as [1, 0, 0, 0]. None: it stays as it is to be turned; without a
    position either, the arm keeps its joints.
    """

    right_position_m: Numbers | None = None
    """Right wrist position [x, y, z] in metres, as [0.30, -0.20, 0.10]. None: it stays where it is to be; without
    an orientation either, the arm keeps its joints.
    """

    right_quaternion_wxyz: Numbers | None = None
    """Right wrist orientation [w, x, y, z], as [1, 0, 0, 0]. None: it stays as it is to be turned; without a
    position either, the arm keeps its joints.
    """

    frame: PoseFrame | None = None
    """The frame of the wrist poses of this entry: "pelvis"; "level", upright in the pelvis; or "start", which
    stays in the room while the robot moves: in it a target may be sent again and again without moving with a
    pelvis that was pushed. None: "pelvis".
    """

    carried: bool | None = None
    """True: the wrist targets move with the pelvis from the command's beginning on, as a robot that carries
    something wants it. False or null: they are fixed in the world.
    """

    keep_waist: bool | None = None
    """True: the waist stays as it is and the arms alone reach, so that the camera keeps its view; until the next
    command for this robot. False or null: the waist turns and leans where the arms do not suffice.
    """

    stand_fast: bool | None = None
    """True: hands stop, as "out_of_reach", before they are so far ahead that the robot would have to step
    (check_reach: needs_a_step); until the next command for this robot. False or null: it steps.
    """

    compliance_n_s_m: float | None = None
    """How both hands give way to what pulls or pushes them along the way that the robot faces, as a partner at the
    other end of a load does: at 1 m/s under as many newtons, up to 6 cm. 250 suits two robots that walk with a
    load; at least 50. None: hands keep to their targets.
    """

    side_compliance_n_s_m: float | None = None
    """How both hands together give way to what pulls or pushes them to the robot's left or right, as a partner who
    sways does: at 1 m/s under as many newtons, up to 6 cm; at least 50. None: not to the sides.
    """

    turn_compliance_n_m_s_rad: float | None = None
    """How both hands together give way to what turns them about the vertical through the middle between the
    wrists: at 1 rad/s under as many newton metres, up to 0.15 rad; at least 5. None: they do not turn.
    """

    left_fingers_rad: Numbers | None = None
    """Left finger joint angles in radians: [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1].
    Positive angles close thumb_1 and thumb_2, negative ones middle and index. None: the target stays. Closed
    around a bottle: [0, 0.75, 0.8, -1.1, -1.3, -1.1, -1.3]; open: [0, -0.3, 0, 0, 0, 0, 0].
    """

    right_fingers_rad: Numbers | None = None
    """Right finger joint angles in radians: [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1].
    Negative angles close thumb_1 and thumb_2, positive ones middle and index. None: the target stays. Closed
    around a bottle: [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3]; open: [0, 0.3, 0, 0, 0, 0, 0].
    """

    vx_m_s: float | None = None
    """Forward velocity in metres per second during this command. None: 0."""

    vy_m_s: float | None = None
    """Velocity to the left in metres per second during this command. None: 0."""

    yaw_rate_rad_s: float | None = None
    """Turning rate in radians per second during this command, counter-clockwise seen from above. None: 0."""

    pelvis_height_m: float | None = None
    """Height of the pelvis above the floor in metres, for a robot that stands; while it steps it may be lower.
    None: the target stays.
    """
