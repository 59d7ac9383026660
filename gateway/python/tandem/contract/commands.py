"""Replies to commands.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from .reading import Reply

BaseState: TypeAlias = Literal[
    "standing",
    "stepping",
    "settling",
    "pushed",
]
"""State of a base."""

Grip: TypeAlias = Literal[
    "none",
    "touching",
    "one_sided",
    "two_sided",
]
"""Contact between the fingers of a hand, by the torques of their drives while they are stopped short of their
targets.
"""

HandPart: TypeAlias = Literal[
    "thumb",
    "middle",
    "index",
    "palm",
]
"""A part of a hand that presses."""

HandState: TypeAlias = Literal[
    "arrived",
    "idle",
    "moving",
    "blocked",
    "out_of_reach",
]
"""State of a wrist or of fingers against their target."""

PoseFrame: TypeAlias = Literal[
    "pelvis",
    "level",
    "start",
    "room",
]
"""Frame of points and poses; the briefing describes each."""

StopReason: TypeAlias = Literal[
    "steps_done",
    "task_complete",
    "step_budget_exhausted",
    "partner_done",
]
"""End of a command."""

Touch: TypeAlias = Literal[
    "itself",
    "something",
]
"""Contact that a hand can feel."""


@dataclass(frozen=True, kw_only=True)
class BaseMotion(Reply):
    """Motion of a pelvis during a command, along the robot's heading when it began."""

    forward_m: float
    """Forward, in metres."""

    left_m: float
    """To the left, in metres."""

    up_m: float
    """Upwards, in metres."""

    turned_rad: float
    """Turn in radians, counter-clockwise from above."""


@dataclass(frozen=True, kw_only=True)
class BaseReport(Reply):
    """Motion of a base, by its own controller and odometry."""

    state: BaseState | None = None
    """Standing or stepping, and the reason; left out where its controller does not distinguish them."""

    pelvis_height_m: float
    """Measured height of the pelvis over the floor, in metres."""

    commanded_height_m: float | None = None
    """Commanded height, where the measured one is more than 2 cm off; left out otherwise."""

    comes_to_rest_m: tuple[float, float] | None = None
    """Predicted resting place of the pelvis if no further step is commanded, [x, y] in the start frame: within 3
    cm after a walk of up to 2.5 s, 5 cm after a longer one. Only for a base that steps or settles.
    """

    displaced_m: tuple[float, float] | None = None
    """Displacement from its resting place of a base commanded to stand, [forward, left] in metres by its heading
    there: something pulled or pushed it. Left out below 2 cm.
    """

    stepped: bool | None = None
    """True if it stepped though commanded to stand, because its arms reached far or were pulled; left out
    otherwise.
    """


@dataclass(frozen=True, kw_only=True)
class Budget(Reply):
    """Remaining budget of an episode."""

    steps_left: int
    """Control steps of 20 ms."""

    wall_clock_left_s: float | None = None
    """Seconds that the policy may still spend between calls; the simulator's time is not counted. Null where the
    protocol sets no limit.
    """

    steps_per_command: int
    """Maximum number of steps per command."""


@dataclass(frozen=True, kw_only=True)
class CommandReply(Reply):
    """The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`. Lengths are rounded to a
    millimetre, angles and quaternions to a thousandth. Marked fields are left out of a short reply.
    """

    executed_steps: int
    """Control steps of 20 ms that were executed."""

    stop_reason: StopReason
    """Reason for its end."""

    time_s: float
    """Simulated seconds since the episode began."""

    robots: tuple[RobotReport, ...]
    """One report per robot that the command named; after `wait`, per robot of the episode. A short reply omits
    robots that have not moved and whose hands have no target and feel nothing.
    """

    fallen: tuple[RobotFallen, ...] = ()
    """Every robot of the episode; in a short reply those that have fallen. Left out where the assistance is
    "paper".
    """

    phases: tuple[PhaseReached, ...]
    """Every phase reached up to now, where the episode's assistance discloses it; in a short reply those reached
    during the call.
    """

    budget: Budget
    """Remaining budget of the episode."""


@dataclass(frozen=True, kw_only=True)
class Effort(Reply):
    """Effort of a joint."""

    joint: str
    """The joint, for example `right_elbow_joint`."""

    share: float
    """Its torque as a share of its limit, from 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class FingerReport(Reply):
    """Outcome of a command for the fingers of one hand. Angles are [thumb_0, thumb_1, thumb_2, middle_0, middle_1,
    index_0, index_1].
    """

    state: HandState | None = None
    """State against their targets; left out where the assistance is "paper"."""

    target_rad: tuple[float, float, float, float, float, float, float] | None = None
    """Commanded joint angles in radians. Left out of a short reply."""

    measured_rad: tuple[float, float, float, float, float, float, float]
    """Measured joint angles in radians."""


@dataclass(frozen=True, kw_only=True)
class HandReport(Reply):
    """Outcome of a command for one hand, at its last step."""

    state: HandState | None = None
    """State of the wrist against its target; left out where the assistance is "paper"."""

    grip: Grip | None = None
    """Grip by the fingers' own torques; left out where the assistance is "paper"."""

    presses: tuple[HandPart, ...] = ()
    """Parts of the hand that press, by the torques of the fingers' own drives; left out where none does, of a
    short reply where the grip is "two_sided", and where the assistance is "paper".
    """

    touches: Touch | None = None
    """Obstacle that the hand feels; left out where it feels none, of a short reply if `grip` says so, and where
    the assistance is "paper".
    """

    target: Pose | None = None
    """Commanded wrist pose in the present pelvis frame, without later yielding; for an arm without a wrist target,
    the pose of its joint targets. Left out of a short reply.
    """

    measured: Pose | None = None
    """Measured wrist pose in the present pelvis frame, its quaternion with the sign nearer to the target's. Left
    out of a short reply where the state is "arrived" or "idle".
    """

    position_error_m: float | None = None
    """Distance from target to measured, in metres. Left out of a short reply where the state is "arrived" or
    "idle".
    """

    orientation_error_rad: float | None = None
    """Angle from target to measured, in radians; left out like the distance."""

    given_way_m: tuple[float, float, float] | None = None
    """Offset of the target that compliance has moved from `target`, [x, y, z] in metres in the pelvis frame; its
    state refers to the moved target. Left out where it has not yielded, and where the assistance is "paper".
    """

    fingers: FingerReport | None = None
    """Its fingers; left out of a short reply where they have arrived or the grip is "two_sided"."""

    largest_effort: Effort | None = None
    """Joint of this arm and hand with the largest share of its torque limit; left out of a short reply if that is
    below 0.8 or of a finger, as of each that presses, and where the assistance is "paper".
    """

    force_n: tuple[float, float, float] | None = None
    """External force on the hand in newtons, [x, y, z] in the pelvis frame, by the arm's own joints: about -4.9
    along z for a held 0.5 kg, a negative x for a hand that presses ahead. Forces that move the arm are
    excluded; a free arm may feel up to 5 N of its own friction. Left out of a short reply where it is less than
    1 N, for an arm that keeps its joints and holds nothing less than 6 N, and where the assistance is "paper".
    """

    joints_clamped: tuple[str, ...] = ()
    """Joints of this arm and hand whose target exceeded a limit and was clamped; left out where there are none."""

    joints_at_limit: tuple[str, ...] = ()
    """Joints of this arm at a limit; left out where there are none, and of a short reply where the state is
    "arrived" or "idle".
    """


@dataclass(frozen=True, kw_only=True)
class PhaseReached(Reply):
    """A reached phase of the task."""

    id: str
    """Name of the phase, for example `grasp_and_lift`."""

    number: str
    """`p1`, `p2`, ... in the order they have to be reached."""

    time_s: float
    """Simulated seconds since the episode began."""


@dataclass(frozen=True, kw_only=True)
class Pose(Reply):
    """A pose in the frame that its field names."""

    position_m: tuple[float, float, float]
    """[x, y, z] in metres."""

    quaternion_wxyz: tuple[float, float, float, float]
    """[w, x, y, z], norm 1."""


@dataclass(frozen=True, kw_only=True)
class RobotFallen(Reply):
    """Fall of a robot."""

    robot: str
    """The robot, for example "A"."""

    fallen: bool
    """True from the moment it fell."""


@dataclass(frozen=True, kw_only=True)
class RobotReport(Reply):
    """Outcome of a command for one robot."""

    robot: str
    """The robot, for example "A"."""

    frame: PoseFrame | None = None
    """Frame of wrist poses, from the command or the walk's targets; left out for the pelvis frame."""

    left: HandReport
    """Its left arm and hand."""

    right: HandReport
    """Its right arm and hand."""

    base: BaseReport | None = None
    """State of its base; left out of a short reply where it stands as commanded, and where the assistance is
    "paper".
    """

    pelvis_in_start: Pose | None = None
    """Pose of its pelvis in the start frame by its own IMU and joints. The start frame is on the floor under the
    pelvis at the start of the episode, z up, x along its heading. Drifts by up to 1 % of the distance walked.
    Left out of a short reply where the base has moved by less than a centimetre and a hundredth of a radian,
    but not after `walk_to`, and where the assistance is "paper".
    """

    pelvis_in_room: Pose | None = None
    """The same in the room frame, if that is `frame`; left out otherwise. In a short reply it replaces
    `pelvis_in_start`.
    """

    base_motion: BaseMotion | None = None
    """Motion of the base during the command, by the same odometry. Left out of a short reply, and where the
    assistance is "paper".
    """

    waist_joints_clamped: tuple[str, ...] = ()
    """Waist joints whose target exceeded a limit and was clamped; left out where there are none."""

    waist_joints_at_limit: tuple[str, ...] = ()
    """Waist joints at a limit; left out where there are none."""

    base_command_clamped: tuple[str, ...] = ()
    """Base command fields that exceeded locomotion's limits and were clamped, for example `vx_m_s`; left out where
    there are none.
    """
