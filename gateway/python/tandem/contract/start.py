"""What a start replies, and what tasks there are.

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
    """What has to be known of the robots to see and to act, in words."""

    frames: str
    """The frames that poses are given in."""

    partners: str
    """How the frames of different robots are related."""

    odometry: str | None
    """What is known of a robot's own way; left out where the assistance is "paper"."""

    camera: str
    """The camera's convention, and what moves it."""

    hands: str
    """The shape of a hand."""

    grasping: str | None
    """How to grasp; left out where the server gives no hints."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Brief:
        """Reads what JSON has."""
        return Brief(
            frames=value["frames"],
            partners=value["partners"],
            odometry=value.get("odometry"),
            camera=value["camera"],
            hands=value["hands"],
            grasping=value.get("grasping"),
        )


@dataclass(frozen=True)
class Briefing:
    """What a policy is told when an episode begins."""

    instruction: str
    """What has to be done."""

    instructions: tuple[Instruction, ...]
    """What each robot has to do."""

    robots: tuple[RobotInfo, ...]
    """The robots."""

    kinds: tuple[RobotKind, ...]
    """What can be asked of robots of each kind."""

    brief: Brief
    """What has to be known to see and to act."""

    action_row: tuple[str, ...]
    """The columns of a row of send_joint_chunk."""

    status: StatusReply
    """Where the episode stands after the initial hold."""

    recording_failed: str | None
    """Why the recording is not complete; left out where it is."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Briefing:
        """Reads what JSON has."""
        return Briefing(
            instruction=value["instruction"],
            instructions=tuple(Instruction.of(item) for item in value["instructions"]),
            robots=tuple(RobotInfo.of(item) for item in value["robots"]),
            kinds=tuple(RobotKind.of(item) for item in value["kinds"]),
            brief=Brief.of(value["brief"]),
            action_row=tuple(value["action_row"]),
            status=StatusReply.of(value["status"]),
            recording_failed=value.get("recording_failed"),
        )


@dataclass(frozen=True)
class Instruction:
    """What one robot has to do."""

    robot: str
    """The robot, as "A"."""

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
    """Unitree's name, as `left_elbow_joint`."""

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
    """What the phase is called, as `transfer`."""

    number: str
    """`p1`, `p2`, ..."""

    description: str
    """When the phase counts as reached."""

    collaborative: bool
    """Whether more than one robot has to work on it."""

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
    """Which protocol."""

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
    """The robot, as "A"."""

    kind: str
    """Which of `kinds` it is."""

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
    """What `robots` call it."""

    joints: tuple[JointInfo, ...]
    """Its joints."""

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
            joints=tuple(JointInfo.of(item) for item in value["joints"]),
            vx_m_s=Range.of(value["vx_m_s"]),
            vy_m_s=Range.of(value["vy_m_s"]),
            yaw_rate_rad_s=Range.of(value["yaw_rate_rad_s"]),
            pelvis_height_m=Range.of(value["pelvis_height_m"]),
        )


@dataclass(frozen=True)
class TaskInfo:
    """One task."""

    id: str
    """What start_episode calls it, as `handover`."""

    instruction: str
    """What has to be done, for whoever directs all robots."""

    robots: tuple[Instruction, ...]
    """What each robot has to do, for policies that direct one."""

    phases: tuple[PhaseInfo, ...]
    """The phases, in the order they have to be reached; left out where the assistance is "paper"."""

    protocols: tuple[ProtocolInfo, ...]
    """The protocols and their budgets for this task."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> TaskInfo:
        """Reads what JSON has."""
        return TaskInfo(
            id=value["id"],
            instruction=value["instruction"],
            robots=tuple(Instruction.of(item) for item in value["robots"]),
            phases=tuple(PhaseInfo.of(item) for item in value.get("phases", ())),
            protocols=tuple(ProtocolInfo.of(item) for item in value["protocols"]),
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
