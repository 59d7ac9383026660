"""Replies to a start, and lists of tasks.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass

from .reading import Reply
from .replies import Protocol, StatusReply


@dataclass(frozen=True, kw_only=True)
class BaseLimits(Reply):
    """Base commands that locomotion accepts; values beyond are clamped and reported."""

    vx_m_s: Range
    """Forward velocity."""

    vy_m_s: Range
    """Velocity to the left."""

    yaw_rate_rad_s: Range
    """Turning rate, counter-clockwise seen from above."""

    pelvis_height_m: Range
    """Height of the pelvis above the floor. Where min equals max the robots cannot squat."""


@dataclass(frozen=True, kw_only=True)
class Brief(Reply):
    """Facts about the robots for seeing and acting, in words."""

    frames: str
    """Frames of poses."""

    partners: str
    """Relation of the frames of different robots."""

    teamwork: str | None = None
    """Playing with partners, for an operator; left out where one policy directs all robots."""

    odometry: str | None = None
    """Odometry of a robot; left out where the assistance is "paper"."""

    camera: str
    """The camera's convention, and what moves it."""

    hands: str
    """The shape of a hand."""

    walking: str | None = None
    """Walking as measured, and the base's states in replies; left out where the assistance is "paper"."""

    grasping: str | None = None
    """Grasping; left out where the server gives no hints."""

    grips: tuple[WorkedGrip, ...] = ()
    """Working grips, explained in `grasping`; left out where the server gives no hints."""


@dataclass(frozen=True, kw_only=True)
class Briefing(Reply):
    """Briefing of a policy at the start of an episode."""

    instruction: str
    """Instruction for all robots."""

    shared_instruction: str | None = None
    """Instruction for operators of one robot each, if `instruction` says more than all may know; left out
    otherwise.
    """

    instructions: tuple[Instruction, ...]
    """Instruction for each robot."""

    robots: tuple[RobotInfo, ...]
    """The robots."""

    phases: tuple[PhaseInfo, ...] = ()
    """The phases of the task, in the order they have to be reached; left out where the assistance is "paper"."""

    room: tuple[str, ...] = ()
    """The task's objects: their sizes along the first robot's axes, and their distances from each robot before the
    seed moves them by about a decimetre. Left out where the assistance is "paper".
    """

    ending: str
    """Ways in which the episode ends, and disclosure of phases."""

    http: tuple[str, ...] = ()
    """Routes of the tools, for clients over HTTP; left out for all others."""

    kinds: tuple[RobotKind, ...]
    """Commands and joints of each kind of robot."""

    brief: Brief
    """Facts for seeing and acting."""

    action_row: tuple[str, ...] = ()
    """The columns of a row of send_joint_chunk; left out of a short reply."""

    status: StatusReply
    """Status of the episode after the initial hold."""

    recording_failed: str | None = None
    """Cause of an incomplete recording; left out otherwise."""


@dataclass(frozen=True, kw_only=True)
class Instruction(Reply):
    """Instruction of one robot."""

    robot: str
    """The robot, for example "A"."""

    instruction: str
    """Its part of the task."""


@dataclass(frozen=True, kw_only=True)
class JointInfo(Reply):
    """One joint."""

    name: str
    """Unitree's name, for example `left_elbow_joint`."""

    lower_rad: float
    """Lower limit in radians."""

    upper_rad: float
    """Upper limit in radians."""

    effort_n_m: float
    """Maximum torque of its drive, in newton metres."""


@dataclass(frozen=True, kw_only=True)
class PhaseInfo(Reply):
    """One phase of a task."""

    id: str
    """Name of the phase, for example `transfer`."""

    number: str
    """`p1`, `p2`, ..."""

    description: str
    """Condition for reaching the phase."""

    collaborative: bool
    """True if more than one robot has to work on it."""


@dataclass(frozen=True, kw_only=True)
class ProtocolInfo(Reply):
    """The budgets of one protocol."""

    protocol: Protocol
    """The protocol."""

    steps_per_command: int
    """Maximum control steps of 20 ms per command."""

    episode_steps: int
    """Control steps of an episode, the initial hold included."""

    initial_hold_steps: int
    """Control steps that start_episode spends holding still."""

    wall_clock_s: float | None = None
    """Seconds that the policy may spend between calls; null for no limit."""

    first_seed: int
    """First seed that results are reported on."""

    last_seed: int
    """Last seed that results are reported on."""


@dataclass(frozen=True, kw_only=True)
class Range(Reply):
    """From `min` to `max`, both included, in the unit of its field."""

    min: float
    """The smallest value accepted."""

    max: float
    """The largest value accepted."""


@dataclass(frozen=True, kw_only=True)
class RobotInfo(Reply):
    """One robot."""

    robot: str
    """The robot, for example "A"."""

    kind: str
    """Its kind, one of `kinds`."""


@dataclass(frozen=True, kw_only=True)
class RobotKind(Reply):
    """A kind of robot: its joints in published order, and what its locomotion accepts."""

    kind: str
    """Name in `robots`."""

    joints: tuple[JointInfo, ...] = ()
    """Its joints; left out of a short reply."""

    vx_m_s: Range
    """Forward velocity."""

    vy_m_s: Range
    """Velocity to the left."""

    yaw_rate_rad_s: Range
    """Turning rate, counter-clockwise seen from above."""

    pelvis_height_m: Range
    """Height of the pelvis above the floor. Where min equals max the robots cannot squat."""


@dataclass(frozen=True, kw_only=True)
class TaskInfo(Reply):
    """One task."""

    id: str
    """Id for start_episode, for example `handover`."""

    suite: str | None = None
    """Its suite, for example `tandem+`; left out for tasks of the benchmark and from files."""

    instruction: str
    """Instruction for a policy of all robots."""

    robots: tuple[Instruction, ...] = ()
    """Instruction for each robot, for policies that direct one; left out of a short reply."""

    phases: tuple[PhaseInfo, ...] = ()
    """The phases, in the order they have to be reached; left out of a short reply, and where the assistance is
    "paper".
    """

    protocols: tuple[ProtocolInfo, ...] = ()
    """The protocols and their budgets for this task; left out of a short reply."""


@dataclass(frozen=True, kw_only=True)
class TaskList(Reply):
    """The reply to `list_tasks`."""

    tasks: tuple[TaskInfo, ...]
    """Every task."""

    base_limits: BaseLimits
    """The base commands that the robots can follow, in every task."""


@dataclass(frozen=True, kw_only=True)
class WorkedGrip(Reply):
    """A working grip of a right hand whose robot squarely faces the object."""

    thing: str
    """Suitable objects."""

    place: str
    """Point of the object at `place_m`."""

    right_quaternion_wxyz: tuple[float, float, float, float]
    """Orientation of the right wrist, in the level frame."""

    left_quaternion_wxyz: tuple[float, float, float, float]
    """Orientation of the left wrist."""

    place_m: tuple[float, float, float]
    """Place of that point in the right wrist's frame while the hand holds it; negate y for a left hand."""

    stops_m: tuple[tuple[float, float, float], ...]
    """Waypoints of the hand's approach, farthest first: offsets from `place_m`."""

    open_rad: tuple[float, float, float, float, float, float, float]
    """Right finger angles for approach and retreat, as in right_fingers_rad; a left hand negates all but the
    first.
    """

    close_rad: tuple[float, float, float, float, float, float, float]
    """Finger angles of a right hand that holds."""

    stand_behind_m: float | None = None
    """Distance of the pelvis behind the places of its hands; left out where that does not matter."""

    pelvis_height_m: float | None = None
    """Pelvis height for the grip; left out where the robot stands upright."""
