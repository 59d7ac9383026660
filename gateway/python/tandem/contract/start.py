"""Replies to a start, and lists of tasks.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass

from .reading import Reply
from .replies import Protocol, StatusReply


@dataclass(frozen=True, kw_only=True)
class BaseLimits(Reply):
    """The base commands that locomotion accepts; what lies beyond is moved to the limit and reported."""

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
    """The frames that poses are given in."""

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
    """Grips that work, as `grasping` says how to use them; left out where the server gives no hints."""


@dataclass(frozen=True, kw_only=True)
class Briefing(Reply):
    """Briefing of a policy at the start of an episode."""

    instruction: str
    """Instruction for all robots."""

    shared_instruction: str | None = None
    """Instruction for those who direct one robot each, where `instruction` says more than all of them may know;
    left out otherwise.
    """

    instructions: tuple[Instruction, ...]
    """Instruction for each robot."""

    robots: tuple[RobotInfo, ...]
    """The robots."""

    phases: tuple[PhaseInfo, ...] = ()
    """The phases of the task, in the order they have to be reached; left out where the assistance is "paper"."""

    room: tuple[str, ...] = ()
    """The things of the task: how large they are, along the first robot's axes, and how far from each robot they
    stand before the seed moves them by a decimetre or so. Left out where the assistance is "paper".
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
    """Why the recording is not complete; left out where it is."""


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
    """The largest torque that its drive exerts, in newton metres."""


@dataclass(frozen=True, kw_only=True)
class PhaseInfo(Reply):
    """One phase of a task."""

    id: str
    """Name of the phase, for example `transfer`."""

    number: str
    """`p1`, `p2`, ..."""

    description: str
    """When the phase counts as reached."""

    collaborative: bool
    """True if more than one robot has to work on it."""


@dataclass(frozen=True, kw_only=True)
class ProtocolInfo(Reply):
    """The budgets of one protocol."""

    protocol: Protocol
    """The protocol."""

    steps_per_command: int
    """The most control steps of 20 ms that one command may ask for."""

    episode_steps: int
    """Control steps of an episode, the initial hold included."""

    initial_hold_steps: int
    """Control steps that start_episode spends holding still."""

    wall_clock_s: float | None = None
    """Seconds that the policy may spend between calls; null for no limit."""

    first_seed: int
    """The seeds that results are reported on: the first."""

    last_seed: int
    """The seeds that results are reported on: the last."""


@dataclass(frozen=True, kw_only=True)
class Range(Reply):
    """From `min` to `max`, both accepted, in the unit of the field that holds it."""

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
    """The suite that it belongs to, for example `tandem+`; left out of the benchmark's tasks and of those of
    files.
    """

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
    """A grip that works, of a right hand whose robot faces the thing squarely."""

    thing: str
    """Things that it suits."""

    place: str
    """Point of the thing that `place_m` is."""

    right_quaternion_wxyz: tuple[float, float, float, float]
    """Orientation of the right wrist, in the level frame."""

    left_quaternion_wxyz: tuple[float, float, float, float]
    """Orientation of the left wrist."""

    place_m: tuple[float, float, float]
    """Place of that point in the right wrist's frame while the hand holds it; negate y for a left hand."""

    stops_m: tuple[tuple[float, float, float], ...]
    """Stops of the hand on its way in, the farthest first: offsets from `place_m`."""

    open_rad: tuple[float, float, float, float, float, float, float]
    """Finger angles of a right hand on its way in and out, as right_fingers_rad; a left one negates all but the
    first.
    """

    close_rad: tuple[float, float, float, float, float, float, float]
    """Finger angles of a right hand that holds."""

    stand_behind_m: float | None = None
    """Distance of the pelvis behind the places of its hands; left out where that does not matter."""

    pelvis_height_m: float | None = None
    """Pelvis height at which hands come there; left out where the robot stands upright."""
