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
    Json,
    Numbers,
    PixelRegion,
    PlannedCommand,
    SurfaceQuery,
    WalkMove,
    WristMove,
    plain,
)
from .commands import CommandReply, PlanReply, PoseFrame
from .depth import DepthReply
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
    ) -> RobotState:
        """Read one robot's proprioception: 43 joint angles, velocities and torques by name, both wrist poses in
        the pelvis frame, which way is down, how far the robot has gone, and the base command in force. Costs no
        steps; physics stands still. Also answers after the episode has ended.

        robot: The robot, as "A".
        """
        arguments: dict[str, Any] = {
            "robot": robot,
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
        """Measure where what a robot's head camera sees is, at pixels named one by one or as a region: at most
        4096 of them either way. Returns a row [u, v, x, y, z] for each pixel: the 3-D point in the robot's
        pelvis frame, the frame that wrist targets are given in. A pixel sees a surface, so the middle of an
        object lies a little behind the point. Costs no steps; physics stands still.

        robot: The robot whose camera measures, as "A".
        pixels: Pixels as [u, v]: column 0 to 319 from the left, row 0 to 239 from the top, at most 4096 of them.
            Example: [[160, 120], [170, 120]]. None: those of `region`.
        region: Pixels of a rectangle, row by row, at most 4096 of them. None: those of `pixels`.
        fit: True: also the plane in `region`, the straight edges at which it ends there, and the corners where they
            meet, fitted to every pixel of it.
        surface: A surface to find, whose middle, size, corners and, where it is upright and round, axis are told in
            place of points: give pixel, [u, v] of a place on it, for the patch of its colour and the whole thing, or
            color, as "red", for the nearest three of that colour.
        frame: The frame of the points: "pelvis", "level" or "start". None: "pelvis".
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
        """Ask whether a robot's wrists could reach poses from where it stands, using the arms that are given a
        pose and the waist. Nothing moves and no steps are spent. Poses are of the wrist links
        (`left_wrist_yaw_link`, `right_wrist_yaw_link`) in the robot's pelvis frame: x forward, y left, z up,
        metres.

        robot: The robot, as "A".
        left_position_m: Left wrist position [x, y, z] in metres, as [0.30, 0.20, 0.10]. None: where it is to be now,
            or, without an orientation either, this arm keeps its joints.
        left_quaternion_wxyz: Left wrist orientation [w, x, y, z], as [1, 0, 0, 0]. None: as it is to be now.
        right_position_m: Right wrist position [x, y, z] in metres, as [0.30, -0.20, 0.10]. None: where it is to be
            now, or, without an orientation either, this arm keeps its joints.
        right_quaternion_wxyz: Right wrist orientation [w, x, y, z], as [1, 0, 0, 0]. None: as it is to be now.
        frame: The frame of the poses: "pelvis", "level" or "start". None: "pelvis".
        keep_waist: True: with the waist as it is, as move_wrists reaches with keep_waist. None: false.
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
        """Move wrists, fingers and base of one or more robots for a number of control steps of 20 ms. Inverse
        kinematics turns wrist poses into arm and waist joints. Robots that are not named hold still; a hand
        without a wrist target keeps its arm's joints, and fingers that are not given keep theirs. The reply
        says of each wrist and its fingers whether they have arrived, are moving (repeat the command or call
        wait), are blocked by load or contact, or are out of reach.

        steps: Control steps of 20 ms: 1 up to the budget's steps_per_command.
        robots: One entry per robot that is to move; each robot at most once.
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
        """Walk, turn, change the pelvis height or look around with one or more robots for a number of control
        steps of 20 ms, while their arms and hands keep their joints and so go along. Velocities are in the
        robot's own frame and apply during this command only; the height persists.

        steps: Control steps of 20 ms: 1 up to the budget's steps_per_command.
        robots: One entry per robot that is to move; each robot at most once. Robots that are not named hold still.
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
        """Send joint targets for one or more robots, one row per control step of 20 ms. Rows of all named robots
        run side by side, so each robot needs the same number of rows: 1 up to the budget's steps_per_command.
        Robots that are not named hold still. Targets beyond a joint's limits are clamped and reported.

        robots: One entry per robot that is to move; each robot at most once.
        """
        arguments: dict[str, Any] = {
            "robots": robots,
        }
        return CommandReply.of(self.call("send_joint_chunk", plain(arguments)))

    def wait(
        self,
        steps: int,
    ) -> CommandReply:
        """Let all robots hold their targets for a number of control steps of 20 ms: for a hand to arrive, for an
        object to come to rest. The reply reports on every robot. Wrist targets of the last command stay fixed
        in the world, or carried, as they were given.

        steps: Control steps of 20 ms: 1 up to the budget's steps_per_command.
        """
        arguments: dict[str, Any] = {
            "steps": steps,
        }
        return CommandReply.of(self.call("wait", plain(arguments)))

    def send_plan(
        self,
        commands: Sequence[PlannedCommand],
    ) -> PlanReply:
        """Carry out up to 20 commands one after another, each as if it had been called by itself: with its own
        steps, recorded and counted as a tool call. The plan stops after the first command after which something
        that it `expects` is not so. The reply is that of the last command carried out, with how many were and
        why no more. If any command could not be carried out, none is.

        commands: The commands, at most 20.
        """
        arguments: dict[str, Any] = {
            "commands": commands,
        }
        return PlanReply.of(self.call("send_plan", plain(arguments)))

    def walk_to(
        self,
        steps: int,
        robots: Sequence[Destination],
    ) -> PlanReply:
        """Walk to places in the start frame, looking at odometry on the way: arms keep their joints and go along,
        or push and carry with `carry`. It is carried out as short commands, each recorded and counted as a tool
        call, until every robot stands within 1.5 cm and 1.5 degrees of its place, one gets no nearer, or the
        steps are used up. It walks straight and looks at nothing: go round what stands in the way by
        `waypoints`.

        steps: The most control steps of 20 ms to take, up to 1500. A way takes about 120, and 250 a metre and 150 a
            quarter turn; where robots carry, 450 a metre.
        robots: One entry per robot that is to walk; each robot at most once. Robots that are not named hold still.
        """
        arguments: dict[str, Any] = {
            "steps": steps,
            "robots": robots,
        }
        return PlanReply.of(self.call("walk_to", plain(arguments)))

    def get_status(
        self,
        *,
        explain: bool | None = None,
    ) -> StatusReply:
        """Ask where the episode stands: time, phases reached, who has fallen, and the budget left. Costs no steps;
        physics stands still. Also answers after the episode has ended.

        explain: True: also what the next phase still lacks, part by part, as it is measured.
        """
        arguments: dict[str, Any] = {
            "explain": explain,
        }
        return StatusReply.of(self.call("get_status", plain(arguments)))

    def finish(
        self,
    ) -> ResultReply:
        """End the episode and get its result. Call it when the task is done or cannot be done any more. After that
        no command is executed; observe, get_robot_state, get_status and finish still answer.
        """
        return ResultReply.of(self.call("finish", {}))
