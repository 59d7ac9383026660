"""Replies to a start, and lists of tasks.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .replies import Protocol, StatusReply


@dataclass(frozen=True)
class BaseLimits:
    """The base commands that locomotion accepts; what lies beyond is moved to the limit and reported."""

    vx_m_s: Range
    """Forward velocity."""

    vy_m_s: Range
    """Velocity to the left."""

    yaw_rate_rad_s: Range
    """Turning rate, counter-clockwise seen from above."""

    pelvis_height_m: Range
    """Height of the pelvis above the floor. Where min equals max the robots cannot squat."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> BaseLimits:
        """Reads what JSON has."""
        return BaseLimits(
            vx_m_s=Range.of(value["vx_m_s"]),
            vy_m_s=Range.of(value["vy_m_s"]),
            yaw_rate_rad_s=Range.of(value["yaw_rate_rad_s"]),
            pelvis_height_m=Range.of(value["pelvis_height_m"]),
        )


@dataclass(frozen=True)
class Brief:
    """Facts about the robots for seeing and acting, in words."""

    frames: str
    """The frames that poses are given in."""

    partners: str
    """Relation of the frames of different robots."""

    teamwork: str | None
    """Playing with partners, for an operator; left out where one policy directs all robots."""

    odometry: str | None
    """Odometry of a robot; left out where the assistance is "paper"."""

    camera: str
    """The camera's convention, and what moves it."""

    hands: str
    """The shape of a hand."""

    walking: str | None
    """Walking as measured, and the base's states in replies; left out where the assistance is "paper"."""

    grasping: str | None
    """Grasping; left out where the server gives no hints."""

    grips: tuple[WorkedGrip, ...]
    """Grips that work, as `grasping` says how to use them; left out where the server gives no hints."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Brief:
        """Reads what JSON has."""
        return Brief(
            frames=value["frames"],
            partners=value["partners"],
            teamwork=value.get("teamwork"),
            odometry=value.get("odometry"),
            camera=value["camera"],
            hands=value["hands"],
            walking=value.get("walking"),
            grasping=value.get("grasping"),
            grips=tuple(WorkedGrip.of(item) for item in value.get("grips", ())),
        )


@dataclass(frozen=True)
class Briefing:
    """Briefing of a policy at the start of an episode."""

    instruction: str
    """Instruction for all robots."""

    shared_instruction: str | None
    """Instruction for those who direct one robot each, where `instruction` says more than all of them may know;
    left out otherwise.
    """

    instructions: tuple[Instruction, ...]
    """Instruction for each robot."""

    robots: tuple[RobotInfo, ...]
    """The robots."""

    phases: tuple[PhaseInfo, ...]
    """The phases of the task, in the order they have to be reached; left out where the assistance is "paper"."""

    room: tuple[str, ...]
    """The things of the task: how large they are, along the first robot's axes, and how far from each robot they
    stand before the seed moves them by a decimetre or so. Left out where the assistance is "paper".
    """

    ending: str
    """Ways in which the episode ends, and disclosure of phases."""

    http: tuple[str, ...]
    """Routes of the tools, for clients over HTTP; left out for all others."""

    kinds: tuple[RobotKind, ...]
    """Commands and joints of each kind of robot."""

    brief: Brief
    """Facts for seeing and acting."""

    action_row: tuple[str, ...]
    """The columns of a row of send_joint_chunk; left out of a short reply."""

    status: StatusReply
    """Status of the episode after the initial hold."""

    recording_failed: str | None
    """Why the recording is not complete; left out where it is."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Briefing:
        """Reads what JSON has."""
        return Briefing(
            instruction=value["instruction"],
            shared_instruction=value.get("shared_instruction"),
            instructions=tuple(Instruction.of(item) for item in value["instructions"]),
            robots=tuple(RobotInfo.of(item) for item in value["robots"]),
            phases=tuple(PhaseInfo.of(item) for item in value.get("phases", ())),
            room=tuple(value.get("room", ())),
            ending=value["ending"],
            http=tuple(value.get("http", ())),
            kinds=tuple(RobotKind.of(item) for item in value["kinds"]),
            brief=Brief.of(value["brief"]),
            action_row=tuple(value.get("action_row", ())),
            status=StatusReply.of(value["status"]),
            recording_failed=value.get("recording_failed"),
        )


@dataclass(frozen=True)
class Instruction:
    """Instruction of one robot."""

    robot: str
    """The robot, for example "A"."""

    instruction: str
    """Its part of the task."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Instruction:
        """Reads what JSON has."""
        return Instruction(
            robot=value["robot"],
            instruction=value["instruction"],
        )


@dataclass(frozen=True)
class JointInfo:
    """One joint."""

    name: str
    """Unitree's name, for example `left_elbow_joint`."""

    lower_rad: float
    """Lower limit in radians."""

    upper_rad: float
    """Upper limit in radians."""

    effort_n_m: float
    """The largest torque that its drive exerts, in newton metres."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> JointInfo:
        """Reads what JSON has."""
        return JointInfo(
            name=value["name"],
            lower_rad=value["lower_rad"],
            upper_rad=value["upper_rad"],
            effort_n_m=value["effort_n_m"],
        )


@dataclass(frozen=True)
class PhaseInfo:
    """One phase of a task."""

    id: str
    """Name of the phase, for example `transfer`."""

    number: str
    """`p1`, `p2`, ..."""

    description: str
    """When the phase counts as reached."""

    collaborative: bool
    """True if more than one robot has to work on it."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> PhaseInfo:
        """Reads what JSON has."""
        return PhaseInfo(
            id=value["id"],
            number=value["number"],
            description=value["description"],
            collaborative=value["collaborative"],
        )


@dataclass(frozen=True)
class ProtocolInfo:
    """The budgets of one protocol."""

    protocol: Protocol
    """The protocol."""

    steps_per_command: int
    """The most control steps of 20 ms that one command may ask for."""

    episode_steps: int
    """Control steps of an episode, the initial hold included."""

    initial_hold_steps: int
    """Control steps that start_episode spends holding still."""

    wall_clock_s: float | None
    """Seconds that the policy may spend between calls; null for no limit."""

    first_seed: int
    """The seeds that results are reported on: the first."""

    last_seed: int
    """The seeds that results are reported on: the last."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> ProtocolInfo:
        """Reads what JSON has."""
        return ProtocolInfo(
            protocol=value["protocol"],
            steps_per_command=value["steps_per_command"],
            episode_steps=value["episode_steps"],
            initial_hold_steps=value["initial_hold_steps"],
            wall_clock_s=value.get("wall_clock_s"),
            first_seed=value["first_seed"],
            last_seed=value["last_seed"],
        )


@dataclass(frozen=True)
class Range:
    """From `min` to `max`, both accepted, in the unit of the field that holds it."""

    min: float
    """The smallest value accepted."""

    max: float
    """The largest value accepted."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Range:
        """Reads what JSON has."""
        return Range(
            min=value["min"],
            max=value["max"],
        )


@dataclass(frozen=True)
class RobotInfo:
    """One robot."""

    robot: str
    """The robot, for example "A"."""

    kind: str
    """Its kind, one of `kinds`."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> RobotInfo:
        """Reads what JSON has."""
        return RobotInfo(
            robot=value["robot"],
            kind=value["kind"],
        )


@dataclass(frozen=True)
class RobotKind:
    """A kind of robot: its joints in published order, and what its locomotion accepts."""

    kind: str
    """Name in `robots`."""

    joints: tuple[JointInfo, ...]
    """Its joints; left out of a short reply."""

    vx_m_s: Range
    """Forward velocity."""

    vy_m_s: Range
    """Velocity to the left."""

    yaw_rate_rad_s: Range
    """Turning rate, counter-clockwise seen from above."""

    pelvis_height_m: Range
    """Height of the pelvis above the floor. Where min equals max the robots cannot squat."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> RobotKind:
        """Reads what JSON has."""
        return RobotKind(
            kind=value["kind"],
            joints=tuple(JointInfo.of(item) for item in value.get("joints", ())),
            vx_m_s=Range.of(value["vx_m_s"]),
            vy_m_s=Range.of(value["vy_m_s"]),
            yaw_rate_rad_s=Range.of(value["yaw_rate_rad_s"]),
            pelvis_height_m=Range.of(value["pelvis_height_m"]),
        )


@dataclass(frozen=True)
class TaskInfo:
    """One task."""

    id: str
    """Id for start_episode, for example `handover`."""

    suite: str | None
    """The suite that it belongs to, for example `tandem+`; left out of the benchmark's tasks and of those of
    files.
    """

    instruction: str
    """Instruction for a policy of all robots."""

    robots: tuple[Instruction, ...]
    """Instruction for each robot, for policies that direct one; left out of a short reply."""

    phases: tuple[PhaseInfo, ...]
    """The phases, in the order they have to be reached; left out of a short reply, and where the assistance is
    "paper".
    """

    protocols: tuple[ProtocolInfo, ...]
    """The protocols and their budgets for this task; left out of a short reply."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> TaskInfo:
        """Reads what JSON has."""
        return TaskInfo(
            id=value["id"],
            suite=value.get("suite"),
            instruction=value["instruction"],
            robots=tuple(Instruction.of(item) for item in value.get("robots", ())),
            phases=tuple(PhaseInfo.of(item) for item in value.get("phases", ())),
            protocols=tuple(ProtocolInfo.of(item) for item in value.get("protocols", ())),
        )


@dataclass(frozen=True)
class TaskList:
    """The reply to `list_tasks`."""

    tasks: tuple[TaskInfo, ...]
    """Every task."""

    base_limits: BaseLimits
    """The base commands that the robots can follow, in every task."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> TaskList:
        """Reads what JSON has."""
        return TaskList(
            tasks=tuple(TaskInfo.of(item) for item in value["tasks"]),
            base_limits=BaseLimits.of(value["base_limits"]),
        )


@dataclass(frozen=True)
class WorkedGrip:
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

    stand_behind_m: float | None
    """Distance of the pelvis behind the places of its hands; left out where that does not matter."""

    pelvis_height_m: float | None
    """Pelvis height at which hands come there; left out where the robot stands upright."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> WorkedGrip:
        """Reads what JSON has."""
        return WorkedGrip(
            thing=value["thing"],
            place=value["place"],
            right_quaternion_wxyz=tuple(value["right_quaternion_wxyz"]),
            left_quaternion_wxyz=tuple(value["left_quaternion_wxyz"]),
            place_m=tuple(value["place_m"]),
            stops_m=tuple(tuple(item) for item in value["stops_m"]),
            open_rad=tuple(value["open_rad"]),
            close_rad=tuple(value["close_rad"]),
            stand_behind_m=value.get("stand_behind_m"),
            pelvis_height_m=value.get("pelvis_height_m"),
        )
