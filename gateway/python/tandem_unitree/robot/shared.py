"""State shared by the threads of one robot's process."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

from ..link import Link
from ..wire.joints import standing_row
from .clock import Clock, ClockKind, LastMessage
from .commands import Commands
from .remarks import Remarks
from .sensing import STEP_S, Moment
from .services import Services


@dataclass(frozen=True)
class RobotSettings:
    """Interfaces and clock of one robot."""

    robot: str
    """The robot, for example "A"."""

    domain: int
    """Number of its DDS domain."""

    interface: str = "lo"
    """Network interface of its DDS topics."""

    address: str = "127.0.0.2"
    """IP address of its ZMQ sockets."""

    clock: ClockKind = "real"
    """Rule by which its time passes."""

    released: bool = False
    """True if it begins with the mode released, so that `rt/lowcmd` drives it."""

    joint_control: bool = False
    """True if `rt/lowcmd` drives every motor with its own gains, and the simulator does not balance the robot."""

    camera_fps: float = 15.0
    """Pictures a second while a client watches; 0 for no cameras."""


class Robot:
    """The commands in force of one robot, and the last two control steps, between which states are interpolated."""

    def __init__(self, settings: RobotSettings, link: Link, last_message: LastMessage | None = None) -> None:
        self.settings = settings
        self.lock = threading.Lock()
        self.clock = Clock(settings.clock, last_message)
        self.remarks = Remarks(settings.robot)
        self.stepped = threading.Event()
        self.latest = self._previous = link.sense(None)
        self._sensed_s = time.monotonic()
        standing = standing_row(self.latest.joints[0], link.limits.pelvis_height_m[1])
        self.commands = Commands(
            standing, link.limits, self.remarks, released=settings.released, joint_control=settings.joint_control
        )
        self.services = Services(self.commands, lambda: self.latest.time_s)

    def begin(self, link: Link) -> None:
        """Begins another episode, in which no command is in force yet."""
        first = link.sense(None)
        with self.lock:
            self.latest = self._previous = first
            self.commands.limits = link.limits
            self.commands.stand(standing_row(first.joints[0], link.limits.pelvis_height_m[1]))

    def sensed(self, moment: Moment) -> None:
        """Takes what the robot senses after a control step."""
        with self.lock:
            self._previous, self.latest = self.latest, moment
            self._sensed_s = time.monotonic()
        self.stepped.set()

    def shown(self) -> Moment:
        """Returns the moment to publish. The last control step is played back within the 20 ms after it.

        A program that balances the robot gets the latest moment at once, which its next command can still answer.
        """
        with self.lock:
            previous, latest, sensed_s = self._previous, self.latest, self._sensed_s
        if self.settings.joint_control:
            return latest
        return previous.until(latest, min(1.0, (time.monotonic() - sensed_s) / STEP_S))
