"""Replies to tools that are no commands.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from .commands import Budget, PhaseReached, Pose, PoseFrame, RobotFallen
from .plans import HeldObject

Assistance: TypeAlias = Literal[
    "paper",
    "full",
]
"""Amount of information that a policy gets."""

Disclosure: TypeAlias = Literal[
    "live",
    "end",
    "never",
]
"""Disclosure of phases in replies, and whether success ends an episode."""

EndReason: TypeAlias = Literal[
    "task_complete",
    "step_budget_exhausted",
    "wall_clock_exhausted",
    "finished",
    "abandoned",
    "policy_failed",
    "simulator_failed",
]
"""Why an episode has ended."""

Protocol: TypeAlias = Literal[
    "agentic",
    "benchmark",
]
"""Rules of an episode."""


@dataclass(frozen=True)
class BaseCommand:
    """The base command in force. Velocities are zero between commands; the height persists."""

    vx_m_s: float
    """Forward velocity in metres per second."""

    vy_m_s: float
    """Velocity to the left in metres per second."""

    yaw_rate_rad_s: float
    """Turning rate in radians per second, counter-clockwise seen from above."""

    pelvis_height_m: float
    """Height of the pelvis above the floor in metres."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> BaseCommand:
        """Reads what JSON has."""
        return BaseCommand(
            vx_m_s=value["vx_m_s"],
            vy_m_s=value["vy_m_s"],
            yaw_rate_rad_s=value["yaw_rate_rad_s"],
            pelvis_height_m=value["pelvis_height_m"],
        )


@dataclass(frozen=True)
class CameraCalibration:
    """A pinhole camera without distortion: a point (x, y, z) in the camera's frame is seen at u = fx x / z + cx, v
    = fy y / z + cy. Axes: x right, y down, z forward (OpenCV's). Pixel (0, 0) is the top left one and its
    centre lies at u = v = 0.
    """

    robot: str
    """The robot whose head carries it."""

    width: int
    """Pixels across."""

    height: int
    """Pixels down."""

    fx: float
    """Focal length across, in pixels."""

    fy: float
    """Focal length down, in pixels."""

    cx: float
    """Column of the optical axis, in pixels."""

    cy: float
    """Row of the optical axis, in pixels."""

    camera_in_pelvis: Pose
    """Pose of the camera's frame in the robot's pelvis frame (x forward, y left, z up)."""

    camera_in_frame: Pose | None
    """The same in the frame that the call named; left out where it named none."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> CameraCalibration:
        """Reads what JSON has."""
        return CameraCalibration(
            robot=value["robot"],
            width=value["width"],
            height=value["height"],
            fx=value["fx"],
            fy=value["fy"],
            cx=value["cx"],
            cy=value["cy"],
            camera_in_pelvis=Pose.of(value["camera_in_pelvis"]),
            camera_in_frame=None if (got := value.get("camera_in_frame")) is None else Pose.of(got),
        )


@dataclass(frozen=True)
class HandReach:
    """Nearest approach of one wrist to a pose."""

    reachable: bool
    """True if it comes within 5 mm and 0.05 rad."""

    position_error_m: float
    """Distance left, in metres."""

    orientation_error_rad: float
    """Angle left, in radians."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> HandReach:
        """Reads what JSON has."""
        return HandReach(
            reachable=value["reachable"],
            position_error_m=value["position_error_m"],
            orientation_error_rad=value["orientation_error_rad"],
        )


@dataclass(frozen=True)
class NextPhase:
    """The phase to reach next."""

    id: str
    """Name of the phase, for example `place`."""

    number: str
    """`p1`, `p2`, ... in the order they have to be reached."""

    lacks: tuple[str, ...]
    """Conditions that do not hold yet, one sentence each. Empty where the next control step reaches the phase."""

    held: tuple[HeldObject, ...]
    """Objects in hands, held as phases ask for by the simulator's contact forces; for an operator those of its own
    robot.
    """

    @staticmethod
    def of(value: Mapping[str, Any]) -> NextPhase:
        """Reads what JSON has."""
        return NextPhase(
            id=value["id"],
            number=value["number"],
            lacks=tuple(value["lacks"]),
            held=tuple(HeldObject.of(item) for item in value.get("held", ())),
        )


@dataclass(frozen=True)
class ReachReply:
    """The reply to `check_reach`."""

    robot: str
    """The robot that was asked about."""

    reachable: bool
    """True if every wrist that was given a pose reaches it, both at once if both were."""

    left: HandReach | None
    """Nearest approach of the left wrist; null if it was given no pose."""

    right: HandReach | None
    """Nearest approach of the right wrist; null if it was given no pose."""

    needs_a_step: bool | None
    """True if the robot would most likely step to keep its balance under arms so far ahead: walk nearer instead.
    Left out where it would not, and where the assistance is "paper".
    """

    joints_at_limit: tuple[str, ...]
    """Joints of the waist and of the arms asked about that would rest at a limit, by name: what keeps the wrists
    from coming nearer.
    """

    @staticmethod
    def of(value: Mapping[str, Any]) -> ReachReply:
        """Reads what JSON has."""
        return ReachReply(
            robot=value["robot"],
            reachable=value["reachable"],
            left=None if (got := value.get("left")) is None else HandReach.of(got),
            right=None if (got := value.get("right")) is None else HandReach.of(got),
            needs_a_step=value.get("needs_a_step"),
            joints_at_limit=tuple(value["joints_at_limit"]),
        )


@dataclass(frozen=True)
class RobotState:
    """The reply to `get_robot_state`. A short one has poses to the millimetre and to a thousandth."""

    robot: str
    """The robot, for example "A"."""

    time_s: float
    """Simulated seconds since the episode began."""

    frame: PoseFrame | None
    """The frame of the wrists where the call named another than that of the pelvis; left out otherwise."""

    joint_positions_rad: dict[str, float] | None
    """Joint angles in radians; left out of a short reply."""

    joint_velocities_rad_s: dict[str, float] | None
    """Joint velocities in radians per second; left out of a short reply, and where the assistance is "paper"."""

    joint_torques_n_m: dict[str, float] | None
    """Joint torques in newton metres, as the drives apply them; left out of a short reply, and where the
    assistance is "paper".
    """

    left_wrist: Pose
    """Measured pose of the left wrist (`left_wrist_yaw_link`) in the pelvis frame (x forward, y left, z up), or in
    `frame`.
    """

    right_wrist: Pose
    """Measured pose of the right wrist (`right_wrist_yaw_link`) in the same frame."""

    left_wrist_target: Pose | None
    """Pose that the left wrist was commanded to, in the same frame, to be sent again to hold the hand: arms sag,
    and one that is sent its measured pose again and again sinks. Left out where the arm keeps its joints
    instead, and where the assistance is "paper".
    """

    right_wrist_target: Pose | None
    """The same of the right wrist."""

    gravity_in_pelvis: tuple[float, float, float] | None
    """The direction of gravity in the pelvis frame, length 1: [0, 0, -1] when upright. Left out of a short reply
    where it is within a hundredth of that, and where the assistance is "paper".
    """

    pelvis_in_start: Pose | None
    """Pose of its pelvis in the start frame by its own IMU and joints. The start frame is on the floor under the
    pelvis at the start of the episode, z up, x the robot's heading then. Drifts by up to 1 % of the way walked.
    Left out of a short reply with `pelvis_in_room`, and where the assistance is "paper".
    """

    pelvis_in_room: Pose | None
    """The same in the room frame, where the call named that; left out otherwise."""

    base_command: BaseCommand | None
    """Base command in force; left out of a short reply where the robot stands as high as commanded."""

    fallen: bool | None
    """True if the robot has fallen; left out of a short reply where it has not, and where the assistance is
    "paper".
    """

    samples: SensorSamples | None
    """Readings of its sensors in each physics step of the last control step, where the call asks for `samples`;
    left out where the assistance is "paper".
    """

    @staticmethod
    def of(value: Mapping[str, Any]) -> RobotState:
        """Reads what JSON has."""
        return RobotState(
            robot=value["robot"],
            time_s=value["time_s"],
            frame=value.get("frame"),
            joint_positions_rad=value.get("joint_positions_rad"),
            joint_velocities_rad_s=value.get("joint_velocities_rad_s"),
            joint_torques_n_m=value.get("joint_torques_n_m"),
            left_wrist=Pose.of(value["left_wrist"]),
            right_wrist=Pose.of(value["right_wrist"]),
            left_wrist_target=None if (got := value.get("left_wrist_target")) is None else Pose.of(got),
            right_wrist_target=None if (got := value.get("right_wrist_target")) is None else Pose.of(got),
            gravity_in_pelvis=None if (got := value.get("gravity_in_pelvis")) is None else tuple(got),
            pelvis_in_start=None if (got := value.get("pelvis_in_start")) is None else Pose.of(got),
            pelvis_in_room=None if (got := value.get("pelvis_in_room")) is None else Pose.of(got),
            base_command=None if (got := value.get("base_command")) is None else BaseCommand.of(got),
            fallen=value.get("fallen"),
            samples=None if (got := value.get("samples")) is None else SensorSamples.of(got),
        )


@dataclass(frozen=True)
class SensorSamples:
    """Readings of a robot's sensors every 5 ms. The last ones are those of the reply's `time_s`."""

    joint_positions_rad: tuple[tuple[float, ...], ...]
    """Angles of the 43 joints in radians, in the order of `joint_positions_rad`."""

    joint_velocities_rad_s: tuple[tuple[float, ...], ...]
    """Velocities of the joints in radians per second."""

    joint_torques_n_m: tuple[tuple[float, ...], ...]
    """Torques of the joints in newton metres."""

    gyro_rad_s: tuple[tuple[float, float, float], ...]
    """Angular velocities of the pelvis in its own frame, as its gyroscope measures them."""

    specific_force_m_s2: tuple[tuple[float, float, float], ...]
    """Specific forces at the IMU in the pelvis frame, as its accelerometer measures them: 9.81 upwards at rest."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> SensorSamples:
        """Reads what JSON has."""
        return SensorSamples(
            joint_positions_rad=tuple(tuple(item) for item in value["joint_positions_rad"]),
            joint_velocities_rad_s=tuple(tuple(item) for item in value["joint_velocities_rad_s"]),
            joint_torques_n_m=tuple(tuple(item) for item in value["joint_torques_n_m"]),
            gyro_rad_s=tuple(tuple(item) for item in value["gyro_rad_s"]),
            specific_force_m_s2=tuple(tuple(item) for item in value["specific_force_m_s2"]),
        )


@dataclass(frozen=True)
class StatusReply:
    """The reply to `get_status`."""

    task: str
    """The task's id."""

    seed: int | None
    """The seed; left out of a short reply, and where the assistance is "paper"."""

    protocol: Protocol
    """The rules in force."""

    time_s: float
    """Simulated seconds since the episode began."""

    env_steps: int
    """Control steps of 20 ms executed up to now, the initial hold included."""

    ended: EndReason | None
    """Why the episode has ended; null while it goes on."""

    fallen: tuple[RobotFallen, ...]
    """Every robot of the episode; in a short reply those that have fallen. Left out where the assistance is
    "paper".
    """

    assistance: Assistance
    """Amount of information. With "paper", phases are disclosed once the episode has ended, which success does not
    do by itself: call finish. With "full", the last phase ends the episode.
    """

    disclosure: Disclosure | None
    """Disclosure of phases, where it is not the assistance's; left out otherwise."""

    phases: tuple[PhaseReached, ...]
    """Every phase reached up to now, where the assistance discloses it."""

    next_phase: NextPhase | None
    """The phase to reach next, and what it lacks; left out where the call did not ask for it, and where phases are
    not disclosed.
    """

    budget: Budget
    """Remaining budget of the episode."""

    state_hash: str | None
    """Hash of the whole physical state, 16 hexadecimal digits. Equal hashes mean equal states. Left out of a short
    reply, and where the assistance is "paper".
    """

    @staticmethod
    def of(value: Mapping[str, Any]) -> StatusReply:
        """Reads what JSON has."""
        return StatusReply(
            task=value["task"],
            seed=value.get("seed"),
            protocol=value["protocol"],
            time_s=value["time_s"],
            env_steps=value["env_steps"],
            ended=value.get("ended"),
            fallen=tuple(RobotFallen.of(item) for item in value.get("fallen", ())),
            assistance=value["assistance"],
            disclosure=value.get("disclosure"),
            phases=tuple(PhaseReached.of(item) for item in value["phases"]),
            next_phase=None if (got := value.get("next_phase")) is None else NextPhase.of(got),
            budget=Budget.of(value["budget"]),
            state_hash=value.get("state_hash"),
        )
