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
"""Why a command ended."""

Touch: TypeAlias = Literal[
    "itself",
    "something",
]
"""Contact of a hand, as far as it can feel that."""


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
    """Predicted resting place of the pelvis if no further step is commanded, [x, y] in the start frame: to within
    3 cm after a walk of up to 2.5 s, 5 cm after a longer one. Only of a base that steps or settles.
    """

    displaced_m: tuple[float, float] | None = None
    """Displacement of a base that was commanded to stand from its resting place, [forward, left] in metres as it
    faced there: something pulled or pushed it. Left out below 2 cm.
    """

    stepped: bool | None = None
    """True where it took a step during the command though it was commanded to stand, after arms that reach far or
    what pulls at them; left out otherwise.
    """


@dataclass(frozen=True, kw_only=True)
class Budget(Reply):
    """Remaining budget of an episode."""

    steps_left: int
    """Control steps of 20 ms."""

    wall_clock_left_s: float | None = None
    """Seconds that the policy may still spend between calls; the simulator's own time is not counted. Null where
    the protocol sets no limit.
    """

    steps_per_command: int
    """The most steps that one command may ask for."""


@dataclass(frozen=True, kw_only=True)
class CommandReply(Reply):
    """The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`. Lengths are told to the
    millimetre, angles and quaternions to a thousandth. What is marked so is left out where the call asked for a
    short reply.
    """

    executed_steps: int
    """Control steps of 20 ms that were executed."""

    stop_reason: StopReason
    """Why the command ended."""

    time_s: float
    """Simulated seconds since the episode began."""

    robots: tuple[RobotReport, ...]
    """One report per robot that the command named; after `wait`, one per robot of the episode. In a short reply
    without robots that stand where they stood, whose hands have no target and feel nothing.
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
    """Joint angles that were asked for, in radians. Left out of a short reply."""

    measured_rad: tuple[float, float, float, float, float, float, float]
    """Joint angles that were measured, in radians."""


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
    """Obstacle that the hand feels; left out where it feels none, of a short reply where `grip` tells it, and
    where the assistance is "paper".
    """

    target: Pose | None = None
    """The wrist pose that was asked for, in the pelvis frame as it is now, and not where the hand has given way to
    since; of an arm without a wrist target, the pose that its joint targets stand for. Left out of a short
    reply.
    """

    measured: Pose | None = None
    """The wrist pose that was measured, in the pelvis frame as it is now, its quaternion with the sign that is
    nearer to the target's. Left out of a short reply where the state is "arrived" or "idle".
    """

    position_error_m: float | None = None
    """Distance from target to measured, in metres. Left out of a short reply where the state is "arrived" or
    "idle".
    """

    orientation_error_rad: float | None = None
    """Angle from target to measured, in radians; left out as the distance is."""

    given_way_m: tuple[float, float, float] | None = None
    """Yielding of the hand by the command's compliance: offset of the yielded target from `target`, [x, y, z] in
    metres in the pelvis frame, against which its state is reported. Left out where it has not yielded, and
    where the assistance is "paper".
    """

    fingers: FingerReport | None = None
    """Its fingers; left out of a short reply where they have arrived or the grip is "two_sided"."""

    largest_effort: Effort | None = None
    """The joint of this arm and hand that works hardest; left out of a short reply where it works at less than
    four fifths of its limit or is of a finger, as of each that presses, and where the assistance is "paper".
    """

    force_n: tuple[float, float, float] | None = None
    """Force of the world on the hand in newtons, [x, y, z] in the pelvis frame, as the arm's own joints feel it: a
    hand that holds 0.5 kg feels about -4.9 along z, one that presses ahead on something a negative x. What
    moving the arm takes is not counted; an arm that hangs free may feel up to 5 N of its own friction. Left out
    of a short reply where it is less than 1 N, of an arm that keeps its joints and holds nothing less than 6 N,
    and where the assistance is "paper".
    """

    joints_clamped: tuple[str, ...] = ()
    """Joints of this arm and hand whose target lay beyond a limit and was moved to it; left out where there are
    none.
    """

    joints_at_limit: tuple[str, ...] = ()
    """Joints of this arm that rest at a limit; left out where there are none, and of a short reply where the state
    is "arrived" or "idle".
    """


@dataclass(frozen=True, kw_only=True)
class PhaseReached(Reply):
    """A phase of the task, and when it was reached."""

    id: str
    """Name of the phase, for example `grasp_and_lift`."""

    number: str
    """`p1`, `p2`, ... in the order they have to be reached."""

    time_s: float
    """Simulated seconds since the episode began."""


@dataclass(frozen=True, kw_only=True)
class Pose(Reply):
    """A pose in the frame that the field which holds it names."""

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
    """The frame of wrist poses: the command's, or that of a walk's places; left out for that of the pelvis."""

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
    pelvis at the start of the episode, z up, x the robot's heading then. Drifts by up to 1 % of the way walked.
    Left out of a short reply where the base has moved by less than a centimetre and a hundredth of a radian,
    but not after `walk_to`, and where the assistance is "paper".
    """

    pelvis_in_room: Pose | None = None
    """The same in the room frame, where `frame` is that; left out otherwise. In a short reply it stands for
    `pelvis_in_start`.
    """

    base_motion: BaseMotion | None = None
    """Motion of the base during the command, by the same odometry. Left out of a short reply, and where the
    assistance is "paper".
    """

    waist_joints_clamped: tuple[str, ...] = ()
    """Waist joints whose target lay beyond a limit and was moved to it; left out where there are none."""

    waist_joints_at_limit: tuple[str, ...] = ()
    """Waist joints that rest at a limit; left out where there are none."""

    base_command_clamped: tuple[str, ...] = ()
    """Fields of the base command that lay beyond what locomotion accepts and were moved to it, as `vx_m_s`; left
    out where there are none.
    """
