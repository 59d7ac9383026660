"""Every tool of an episode as a method.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

from .arguments import (
    Destination,
    JointChunk,
    JointDrives,
    Json,
    Numbers,
    PixelRegion,
    PlannedCommand,
    SurfaceQuery,
    WalkMove,
    WristMove,
    plain,
)
from .commands import CommandReply, PoseFrame
from .depth import DepthReply
from .plans import PlanReply
from .replies import ReachReply, RobotState, StatusReply
from .result import ResultReply


class Tools(ABC):
    """What can be asked of an episode, wherever it runs."""

    @abstractmethod
    def call(self, tool: str, arguments: Mapping[str, Json]) -> Any:
        """Calls the tool of this name, and returns its reply as JSON has it."""

    def get_robot_state(
        self,
        robot: str,
        *,
        frame: PoseFrame | None = None,
    ) -> RobotState:
        """Read one robot's proprioception without an image: wrist poses in the pelvis frame, which way is down,
        odometry, the base command in force and, unless `short`, 43 joint angles, velocities and torques. Costs
        no steps.

        Args:
            robot: The robot, for example "A".
            frame: Frame of wrists; "room": also of pelvis.
        """
        arguments: dict[str, Any] = {
            "robot": robot,
            "frame": frame,
        }
        return RobotState.of(self.call("get_robot_state", plain(arguments)))

    def query_depth(
        self,
        robot: str,
        *,
        pixels: Numbers | None = None,
        region: PixelRegion | None = None,
        fit: bool | None = None,
        surface: SurfaceQuery | None = None,
        frame: PoseFrame | None = None,
    ) -> DepthReply:
        """Measure the points that a robot's head camera sees at up to 4096 pixels, listed or filling a region.
        Returns a row [u, v, x, y, z] for each, in the pelvis frame as wrist targets. A pixel sees a surface;
        the middle of an object is a little behind it. Costs no steps.

        Args:
            robot: The robot, for example "A".
            pixels: Pixels [u, v], column 0 to 319 from the left, row 0 to 239 from the top.
            region: Pixels of a rectangle, row by row.
            fit: True: the largest plane in `region`, its straight edges and corners in place of points.
            surface: Middle, size, corners and, for an upright round object, axis of a surface in place of points.
            frame: Frame of the points.
        """
        arguments: dict[str, Any] = {
            "robot": robot,
            "pixels": pixels,
            "region": region,
            "fit": fit,
            "surface": surface,
            "frame": frame,
        }
        return DepthReply.of(self.call("query_depth", plain(arguments)))

    def check_reach(
        self,
        robot: str,
        *,
        left_position_m: Numbers | None = None,
        left_quaternion_wxyz: Numbers | None = None,
        right_position_m: Numbers | None = None,
        right_quaternion_wxyz: Numbers | None = None,
        frame: PoseFrame | None = None,
        keep_waist: bool | None = None,
    ) -> ReachReply:
        """Ask whether wrists could reach poses, as in move_wrists, from the robot's place, with the waist and the
        arms that are given a pose. Nothing moves; costs no steps.

        Args:
            robot: The robot, for example "A".
            left_position_m: Left wrist [x, y, z]. None: the present target.
            left_quaternion_wxyz: Left wrist orientation.
            right_position_m: Right wrist.
            right_quaternion_wxyz: Right wrist orientation.
            frame: Frame of the poses.
            keep_waist: True: the waist stays fixed.
        """
        arguments: dict[str, Any] = {
            "robot": robot,
            "left_position_m": left_position_m,
            "left_quaternion_wxyz": left_quaternion_wxyz,
            "right_position_m": right_position_m,
            "right_quaternion_wxyz": right_quaternion_wxyz,
            "frame": frame,
            "keep_waist": keep_waist,
        }
        return ReachReply.of(self.call("check_reach", plain(arguments)))

    def move_wrists(
        self,
        steps: int,
        robots: Sequence[WristMove],
    ) -> CommandReply:
        """Move wrists, fingers and base for a number of control steps of 20 ms; inverse kinematics finds arm and
        waist joints. Robots that are not named hold still; arms and fingers without targets keep their joints.
        The reply says whether each wrist has arrived, is moving (repeat or wait), is blocked by load or
        contact, or is out of reach.

        Args:
            steps: 1 up to the budget's steps_per_command.
            robots: One entry per robot that moves.
        """
        arguments: dict[str, Any] = {
            "steps": steps,
            "robots": robots,
        }
        return CommandReply.of(self.call("move_wrists", plain(arguments)))

    def walk(
        self,
        steps: int,
        robots: Sequence[WalkMove],
    ) -> CommandReply:
        """Walk, turn, change the pelvis height or look around for a number of control steps of 20 ms. Arms and
        hands keep their joints and go along. Velocities are in the robot's own frame and apply during this
        command; the height persists.

        Args:
            steps: 1 up to the budget's steps_per_command.
            robots: One entry per robot that moves. Others hold still.
        """
        arguments: dict[str, Any] = {
            "steps": steps,
            "robots": robots,
        }
        return CommandReply.of(self.call("walk", plain(arguments)))

    def send_joint_chunk(
        self,
        robots: Sequence[JointChunk],
    ) -> CommandReply:
        """Send joint targets, one row per control step of 20 ms. Rows of all named robots run side by side, so
        each needs the same number: 1 up to the budget's steps_per_command. Other robots hold still. Targets
        beyond joint limits are clamped and reported.

        Args:
            robots: One entry per robot that moves.
        """
        arguments: dict[str, Any] = {
            "robots": robots,
        }
        return CommandReply.of(self.call("send_joint_chunk", plain(arguments)))

    def send_joint_drives(
        self,
        robots: Sequence[JointDrives],
    ) -> CommandReply:
        """Drive every joint yourself, legs included, one row per control step of 20 ms: a motor exerts torque_n_m
        + kp (position - q) + kd (velocity - q'), within its limits. The robot's balance controller, the
        compensation of gravity and the simulator's gains are off, and a robot that does not balance falls.
        Afterwards the last row stays in force until the robot's next command; every other command but wait
        hands the robot back to the balance controller, from the posture in which it is.

        Args:
            robots: One entry per robot that is driven. Each needs the same number of rows; other robots hold still.
        """
        arguments: dict[str, Any] = {
            "robots": robots,
        }
        return CommandReply.of(self.call("send_joint_drives", plain(arguments)))

    def wait(
        self,
        steps: int,
    ) -> CommandReply:
        """Let all robots hold their targets for a number of control steps of 20 ms. The reply reports on every
        robot.

        Args:
            steps: 1 up to the budget's steps_per_command.
        """
        arguments: dict[str, Any] = {
            "steps": steps,
        }
        return CommandReply.of(self.call("wait", plain(arguments)))

    def send_plan(
        self,
        commands: Sequence[PlannedCommand],
        *,
        until_heard: bool | None = None,
    ) -> PlanReply:
        """Carry out up to 20 commands in order, each counted as a tool call, until one's `expects` does not hold.
        With `until`, a command lasts until it does: lower a hand until it touches, wait until a phase is
        reached. Returns the last command's reply, how many were carried out, and why no more. If one is
        invalid, none is.

        Args:
            commands: Commands.
            until_heard: True: words of another operator end it.
        """
        arguments: dict[str, Any] = {
            "commands": commands,
            "until_heard": until_heard,
        }
        return PlanReply.of(self.call("send_plan", plain(arguments)))

    def walk_to(
        self,
        steps: int,
        robots: Sequence[Destination],
        *,
        frame: PoseFrame | None = None,
        until_heard: bool | None = None,
    ) -> PlanReply:
        """Walk to places by odometry; arms go along, or push and carry with `carry`. Short commands, each a tool
        call, take every robot to within 1.5 cm and 1.5 degrees of its place, unless one gets no nearer or steps
        run out. It does not look: go round obstacles by `waypoints`.

        Args:
            steps: Most steps, up to 1500: about 300, 170 a metre and 250 a quarter turn; with `carry` 300, 270 and
                220.
            robots: One entry per robot that walks.
            frame: Frame of places and headings.
            until_heard: True: words of another operator end it; with `carry` the robot comes to rest first.
        """
        arguments: dict[str, Any] = {
            "steps": steps,
            "robots": robots,
            "frame": frame,
            "until_heard": until_heard,
        }
        return PlanReply.of(self.call("walk_to", plain(arguments)))

    def get_status(
        self,
        *,
        explain: bool | None = None,
    ) -> StatusReply:
        """Ask how the episode is going: time, phases reached, fallen robots, and the budget left. Costs no steps.

        Args:
            explain: True: also what the next phase lacks, and where held things are.
        """
        arguments: dict[str, Any] = {
            "explain": explain,
        }
        return StatusReply.of(self.call("get_status", plain(arguments)))

    def finish(
        self,
    ) -> ResultReply:
        """End the episode and get its result. After that no command is executed; reads still answer."""
        return ResultReply.of(self.call("finish", {}))
