"""The process of one robot: three threads that exchange messages, make control steps and fetch pictures."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

from tandem import EpisodeEnded, TandemError

from .exchange import Exchange
from .link import Access, Link
from .robot.clock import LastMessage, PictureTurns
from .robot.remarks import LOG, log_to_stderr
from .robot.shared import Robot, RobotSettings

END_POLL_S = 0.2
"""Period at which a robot whose episode has ended asks for another one."""

IDLE_PICTURE_S = 0.05
"""Period at which cameras look for clients."""


class Adapter:
    """One robot on all its interfaces.

    next_access: Waits for up to the given seconds and returns the access to the next episode; `None` where there is none.
    last_message: When a program was last heard, shared by the episode's robots.
    """

    def __init__(
        self,
        settings: RobotSettings,
        access: Access,
        next_access: Callable[[float], Access | None],
        last_message: LastMessage | None = None,
    ) -> None:
        self._settings = settings
        self._next_access = next_access
        self._link = Link(access)
        self._access = access
        if self._link.robot != settings.robot:
            raise TandemError(f"the token is of robot {self._link.robot}, not of {settings.robot}")
        self.robot = Robot(settings, self._link, last_message)
        self._stop = threading.Event()
        self.steps = 0
        self.late = 0
        self.busy_s = 0.0

    def run(self) -> None:
        """Serves the robot until `stop` is called or no episode follows."""
        from .transport.dds import Dds
        from .transport.lerobot import LeRobot

        settings = self._settings
        topics = Dds(settings.domain, settings.interface)
        exchange = Exchange(self.robot, topics, LeRobot(settings.address))
        self._join()
        workers = [threading.Thread(target=self._guarded, args=(self._step,), daemon=True)]
        if settings.camera_fps > 0:
            workers.append(threading.Thread(target=self._guarded, args=(self._look,), daemon=True))
        for worker in workers:
            worker.start()
        LOG.info(
            "robot %s: DDS domain %d on %s; LeRobot and teleimager at %s; clock %s",
            *(settings.robot, settings.domain, settings.interface, settings.address, settings.clock),
        )
        begun_s = time.monotonic()
        try:
            exchange.run(self._stop)
        finally:
            self._stop.set()
            for worker in workers:
                worker.join(2.0)
            topics.close()
            self._say_figures(exchange.low_states, time.monotonic() - begun_s)

    def stop(self) -> None:
        """Ends `run`."""
        self._stop.set()

    def _guarded(self, work: Callable[[], None]) -> None:
        """Runs a thread; if it fails, the robot is no longer served."""
        try:
            work()
        except TandemError as error:
            if not self._stop.is_set():
                LOG.error("robot %s: %s", self._settings.robot, error)
        finally:
            self._stop.set()

    def _step(self) -> None:
        """Makes a control step every 20 ms. Where the clock holds, it only follows what the other robots do."""
        robot = self.robot
        while not self._stop.wait(robot.clock.wait_s()):
            begun_s = time.monotonic()
            try:
                with robot.lock:
                    passes = robot.clock.passes(robot.commands.walks(robot.latest.time_s))
                    drives = robot.commands.drives()
                    row = robot.commands.row(robot.latest.time_s)
                if passes and not (self._link.command(row) if drives is None else self._link.drive(drives)):
                    self.late += 1
                    continue
                if not passes and not self._link.has_moved():
                    continue
                robot.sensed(self._link.sense(robot.latest))
            except EpisodeEnded:
                if not self._begin_next():
                    return
            self.steps += 1
            self.busy_s += time.monotonic() - begun_s

    def _begin_next(self) -> bool:
        """Waits for the next episode; returns whether there is one."""
        robot = self.robot
        LOG.info("robot %s: the episode has ended; states go on as they are", self._settings.robot)
        while not self._stop.is_set():
            try:
                access = self._next_access(END_POLL_S)
            except (EOFError, OSError):
                return False
            if access is not None:
                self._access = access
                self._link.close()
                self._link = Link(access)
                robot.begin(self._link)
                self._join()
                return True
        return False

    def _join(self) -> None:
        """Has partners' commands go on over this robot's steps, and notes interface and clock in the recording."""
        self._link.pace()
        robot, clock = self._settings.robot, self._settings.clock
        self._link.note(
            f"Robot {robot} is driven over the interfaces of a Unitree G1 (tandem_unitree), clock {clock}. Its programs are "
            "told joint velocities, torques, orientation, inertial readings and odometry, which observations of the benchmark "
            "do not have."
        )

    def _look(self) -> None:
        """Fetches pictures while a client watches."""
        from .transport.cameras import Cameras

        cameras = Cameras(self._settings.address, self._settings.camera_fps)
        turns = PictureTurns(ord(self._settings.robot) - ord("A"), self._settings.camera_fps)
        access, link = self._access, Link(self._access)
        while not self._stop.is_set():
            cameras.answer()
            if not cameras.are_watched():
                self._stop.wait(IDLE_PICTURE_S)
                continue
            self.robot.stepped.wait(IDLE_PICTURE_S)
            self.robot.stepped.clear()
            if not turns.is_due(time.monotonic()):
                continue
            if access is not self._access:
                access, link = self._access, Link(self._access)
            try:
                cameras.publish(link.picture()[1])
            except EpisodeEnded:
                self._stop.wait(END_POLL_S)

    def _say_figures(self, low_states: int, wall_s: float) -> None:
        LOG.info(
            "robot %s: %d control steps in %.1f s, %.2f ms each; %d refused; lowstate at %.1f Hz; %d wrong checksums",
            *(self._settings.robot, self.steps, wall_s, 1000 * self.busy_s / max(1, self.steps)),
            *(self.late, low_states / max(1e-9, wall_s), self.robot.commands.bad_crcs),
        )


def serve_robot(settings: RobotSettings, connection: Connection, last_message: LastMessage) -> None:
    """Runs the process of one robot. Accesses come by `connection`, so that no token is on a command line."""
    log_to_stderr()

    def next_access(wait_s: float) -> Access | None:
        return connection.recv() if connection.poll(wait_s) else None

    try:
        Adapter(settings, connection.recv(), next_access, last_message).run()
    except (EOFError, KeyboardInterrupt):
        return
    except TandemError as error:
        LOG.error("robot %s: %s", settings.robot, error)
