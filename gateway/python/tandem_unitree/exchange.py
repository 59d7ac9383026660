"""The exchange with a robot's programs: commands are read and states are published, in one thread."""

from __future__ import annotations

import time
from threading import Event
from typing import Protocol

from .robot.commands import RELEASED
from .robot.messages import Messages
from .robot.remarks import LOG
from .robot.services import SERVICES
from .robot.shared import Robot
from .transport.lerobot import LeRobot
from .wire.joints import HANDS
from .wire.rpc import Request, response

STATE_S = 0.004
"""Period of `rt/lowstate` and `rt/secondary_imu`: 250 Hz."""

TURNS_PER_HAND = 2
"""Turns of 4 ms between two states of the hands, the odometry, and LeRobot's state: 125 Hz."""

TURNS_PER_SLOW_STATE = 5
"""Turns between two messages of `rt/lf/lowstate`: 50 Hz."""

TURNS_PER_BATTERY = 25
"""Turns between two messages of `rt/lf/bmsstate`: 10 Hz."""

LATEST_TURN_S = 0.1
"""A thread that is later than this leaves the turns out that it has missed."""


class Topics(Protocol):
    """A robot's topics, as serialized messages."""

    def write(self, topic: str, message: bytes) -> None:
        """Publishes a message."""
        ...

    def take(self, topic: str) -> list[bytes]:
        """Returns the messages that have come since the last call, oldest first."""
        ...


class Exchange:
    """The topics and sockets of one robot."""

    def __init__(self, robot: Robot, topics: Topics, lerobot: LeRobot | None) -> None:
        self._robot = robot
        self._topics = topics
        self._lerobot = lerobot
        self._messages = Messages()
        self._turn = 0
        self.low_states = 0

    def run(self, stop: Event) -> None:
        """Exchanges messages every 4 ms until `stop` is set."""
        due_s = time.monotonic()
        while not stop.is_set():
            self.take()
            self.publish()
            due_s = max(due_s + STATE_S, time.monotonic() - LATEST_TURN_S)
            time.sleep(max(0.0, due_s - time.monotonic()))

    def take(self) -> None:
        """Reads the messages of programs."""
        robot = self._robot
        with robot.lock:
            heard = self._take_joints()
            for service in SERVICES:
                for message in self._topics.take(f"rt/api/{service}/request"):
                    heard = True
                    self._answer(service, message)
        if heard:
            robot.clock.heard()

    def _take_joints(self) -> bool:
        """Reads joint commands, of which the newest that is valid counts; returns whether there were any."""
        commands = self._robot.commands
        heard = False
        for topic, take in (("rt/lowcmd", commands.low_command), ("rt/arm_sdk", commands.arm_command)):
            messages = self._topics.take(topic)
            heard = heard or bool(messages)
            any(take(message) for message in reversed(messages))
        for side in HANDS:
            messages = self._topics.take(f"rt/dex3/{side}/cmd")
            heard = heard or bool(messages)
            for message in messages[-1:]:
                commands.hand_command(side, message)
        record = None if self._lerobot is None else self._lerobot.take()
        if record is not None:
            heard = True
            # LeRobot's own server releases the mode before it takes a command.
            commands.select_mode(RELEASED)
            commands.low_record(record)
        return heard

    def _answer(self, service: str, message: bytes) -> None:
        request = Request.of(message)
        if request is None:
            return
        code, data = self._robot.services.answer(service, request)
        LOG.debug(
            "robot %s: %s %d %s: %d %s", self._robot.settings.robot, service, request.api_id, request.parameter, code, data
        )
        if not request.noreply:
            self._topics.write(f"rt/api/{service}/response", response(request, code, data))

    def publish(self) -> None:
        """Publishes the messages that are due in this turn."""
        messages, topics = self._messages, self._topics
        moment = self._robot.shown()
        low_state = messages.low_state(moment)
        topics.write("rt/lowstate", low_state)
        topics.write("rt/secondary_imu", messages.torso_imu(moment))
        self.low_states += 1
        if self._turn % TURNS_PER_HAND == 0:
            for side in HANDS:
                topics.write(f"rt/dex3/{side}/state", messages.hand_state(side, moment))
            topics.write("rt/odommodestate", messages.odometry(moment))
            if self._lerobot is not None:
                self._lerobot.publish(messages.low_record)
        if self._turn % TURNS_PER_SLOW_STATE == 0:
            topics.write("rt/lf/lowstate", low_state)
        if self._turn % TURNS_PER_BATTERY == 0:
            topics.write("rt/lf/bmsstate", messages.battery)
        self._turn += 1
