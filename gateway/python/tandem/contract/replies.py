"""Replies to tools that are no commands.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from .commands import Budget, PhaseReached, Pose, PoseFrame, RobotFallen
from .plans import HeldObject
from .reading import Reply

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
"""End of an episode."""

Protocol: TypeAlias = Literal[
    "agentic",
    "benchmark",
]
"""Rules of an episode."""


@dataclass(frozen=True, kw_only=True)
class BaseCommand(Reply):
    """The present base command. Velocities are zero between commands; the height persists."""

    vx_m_s: float
    """Forward velocity in metres per second."""

    vy_m_s: float
    """Velocity to the left in metres per second."""

    yaw_rate_rad_s: float
    """Turning rate in radians per second, counter-clockwise seen from above."""

    pelvis_height_m: float
    """Height of the pelvis above the floor in metres."""


@dataclass(frozen=True, kw_only=True)
class CameraCalibration(Reply):
    """A pinhole camera: a point (x, y, z) in the camera's frame is seen at u = fx x / z + cx, v = fy y / z + cy.
    Axes: x right, y down, z forward (OpenCV's). Pixel (0, 0) is the top left one and its centre is at u = v =
    0.
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

    camera_in_frame: Pose | None = None
    """The same in the frame that the call named; left out where it named none."""

    distortion: LensDistortion | None = None
    """Distortion of its lens; left out where it has none."""


@dataclass(frozen=True, kw_only=True)
class HandReach(Reply):
    """Nearest approach of one wrist to a pose."""

    reachable: bool
    """True if it comes within 5 mm and 0.05 rad."""

    position_error_m: float
    """Position error in metres."""

    orientation_error_rad: float
    """Angle error in radians."""


@dataclass(frozen=True, kw_only=True)
class LensDistortion(Reply):
    """Brown-Conrady distortion of a lens: OpenCV's `projectPoints` defines x' and y', which replace x / z and y /
    z. Points of query_depth need no correction.
    """

    model: str
    """Name of the model: "brown_conrady"."""

    coefficients: tuple[float, float, float, float, float]
    """Its coefficients, in the order of OpenCV: k1, k2, p1, p2, k3."""


@dataclass(frozen=True, kw_only=True)
class NextPhase(Reply):
    """The phase to reach next."""

    id: str
    """Name of the phase, for example `place`."""

    number: str
    """`p1`, `p2`, ... in the order they have to be reached."""

    lacks: tuple[str, ...]
    """Conditions that do not hold yet, one sentence each. Empty where the next control step reaches the phase."""

    held: tuple[HeldObject, ...] = ()
    """Objects that count as held for phases, by the simulator's contact forces; for an operator only those of its
    robot.
    """


@dataclass(frozen=True, kw_only=True)
class ReachReply(Reply):
    """The reply to `check_reach`."""

    robot: str
    """The robot that was asked about."""

    reachable: bool
    """True if every wrist that was given a pose reaches it, both at once if both were."""

    left: HandReach | None = None
    """Nearest approach of the left wrist; null if it was given no pose."""

    right: HandReach | None = None
    """Nearest approach of the right wrist; null if it was given no pose."""

    needs_a_step: bool | None = None
    """True if the robot would probably step for balance with its arms so far ahead: walk nearer instead. Left out
    otherwise, and where the assistance is "paper".
    """

    joints_at_limit: tuple[str, ...]
    """Names of the waist and arm joints that would be at a limit, which keeps the wrists from coming nearer."""


@dataclass(frozen=True, kw_only=True)
class RobotState(Reply):
    """The reply to `get_robot_state`. A short one rounds poses to a millimetre and a thousandth."""

    robot: str
    """The robot, for example "A"."""

    time_s: float
    """Simulated seconds since the episode began."""

    frame: PoseFrame | None = None
    """Frame of the wrists, if the call named another than the pelvis; left out otherwise."""

    joint_positions_rad: dict[str, float] | None = None
    """Joint angles in radians; left out of a short reply."""

    joint_velocities_rad_s: dict[str, float] | None = None
    """Joint velocities in radians per second; left out of a short reply, and where the assistance is "paper"."""

    joint_torques_n_m: dict[str, float] | None = None
    """Joint torques in newton metres, as the drives apply them; left out of a short reply, and where the
    assistance is "paper".
    """

    left_wrist: Pose
    """Measured pose of the left wrist (`left_wrist_yaw_link`) in the pelvis frame (x forward, y left, z up), or in
    `frame`.
    """

    right_wrist: Pose
    """Measured pose of the right wrist (`right_wrist_yaw_link`) in the same frame."""

    left_wrist_target: Pose | None = None
    """Commanded pose of the left wrist in the same frame. Send it again to hold the hand: arms sag, and a hand
    that is repeatedly sent its measured pose sinks. Left out where the arm keeps its joints instead, and where
    the assistance is "paper".
    """

    right_wrist_target: Pose | None = None
    """The same of the right wrist."""

    gravity_in_pelvis: tuple[float, float, float] | None = None
    """The direction of gravity in the pelvis frame, length 1: [0, 0, -1] when upright. Left out of a short reply
    where it is within a hundredth of that, and where the assistance is "paper".
    """

    pelvis_in_start: Pose | None = None
    """Pose of its pelvis in the start frame by its own IMU and joints. The start frame is on the floor under the
    pelvis at the start of the episode, z up, x along its heading. Drifts by up to 1 % of the distance walked.
    Left out of a short reply with `pelvis_in_room`, and where the assistance is "paper".
    """

    pelvis_in_room: Pose | None = None
    """The same in the room frame, if the call named it; left out otherwise."""

    base_command: BaseCommand | None = None
    """Base command in force; left out of a short reply where the robot stands as high as commanded."""

    fallen: bool | None = None
    """True if the robot has fallen; left out of a short reply where it has not, and where the assistance is
    "paper".
    """

    samples: SensorSamples | None = None
    """Readings of its sensors in each physics step of the last control step, if the call requests `samples`; left
    out where the assistance is "paper".
    """


@dataclass(frozen=True, kw_only=True)
class SensorSamples(Reply):
    """Sensor readings of a robot every 5 ms. The last are at the reply's `time_s`."""

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


@dataclass(frozen=True, kw_only=True)
class StatusReply(Reply):
    """The reply to `get_status`."""

    task: str
    """The task's id."""

    seed: int | None = None
    """The seed; left out of a short reply, and where the assistance is "paper"."""

    protocol: Protocol
    """The rules in force."""

    time_s: float
    """Simulated seconds since the episode began."""

    env_steps: int
    """Control steps of 20 ms executed up to now, the initial hold included."""

    ended: EndReason | None = None
    """Cause of the end; null while the episode runs."""

    fallen: tuple[RobotFallen, ...] = ()
    """Every robot of the episode; in a short reply those that have fallen. Left out where the assistance is
    "paper".
    """

    assistance: Assistance
    """Amount of information. With "paper", phases are disclosed once the episode has ended; success does not end
    it: call finish. With "full", the last phase ends the episode.
    """

    disclosure: Disclosure | None = None
    """Disclosure of phases, if unlike the assistance's; left out otherwise."""

    phases: tuple[PhaseReached, ...]
    """Every phase reached up to now, where the assistance discloses it."""

    next_phase: NextPhase | None = None
    """The next phase and its unmet conditions; left out unless requested, and where phases are not disclosed."""

    budget: Budget
    """Remaining budget of the episode."""

    state_hash: str | None = None
    """Hash of the whole physical state, 16 hexadecimal digits. Equal hashes mean equal states. Left out of a short
    reply, and where the assistance is "paper".
    """
