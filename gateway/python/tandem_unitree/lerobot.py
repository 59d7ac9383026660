"""LeRobot's protocol for `unitree_g1`: commands and states as JSON over ZMQ, as its `run_g1_server.py` speaks it."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import zmq

from .joints import MOTORS
from .layout import LOW_COMMAND, Record, blank

COMMAND_PORT = 6000
"""Port of commands: PULL here, PUSH at the client."""

STATE_PORT = 6001
"""Port of states: PUB here, SUB at the client."""

_FIELDS = ("q", "dq", "tau", "kp", "kd")


def command_of(payload: bytes) -> Record | None:
    """Returns the `LowCmd_` in a message of a client, or `None` if it is none."""
    try:
        message = json.loads(payload)
        if message.get("topic") != "rt/lowcmd":
            return None
        data = message["data"]
        motors: list[dict[str, Any]] = data["motor_cmd"]
        record = blank(LOW_COMMAND)
        record["mode_pr"] = int(data.get("mode_pr", 0))
        record["mode_machine"] = int(data.get("mode_machine", 0))
        modes = [int(motor.get("mode", 0)) for motor in motors[:MOTORS]]
        record["first_mode"] = modes[0]
        record["motors"]["next_mode"][: len(modes) - 1] = modes[1:]
        for name in _FIELDS:
            column = [motor.get(name, 0) for motor in motors[:MOTORS]]
            record["motors"][name][: len(column)] = column
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError):
        return None
    return record


def state_payload(low: Record) -> bytes:
    """Returns the message that tells a `LowState_`; a motor's temperature is the mean of its two."""
    motors = low["motors"]
    columns = zip(
        motors["q"].tolist(),
        motors["dq"].tolist(),
        motors["tau_est"].tolist(),
        np.mean(motors["temperature"], axis=1).tolist(),
        strict=True,
    )
    states = [{"q": q, "dq": dq, "tau_est": tau, "temperature": celsius} for q, dq, tau, celsius in columns]
    imu = low["imu"]
    data = {
        "motor_state": states,
        "imu_state": {
            **{name: imu[name].tolist() for name in ("quaternion", "gyroscope", "accelerometer", "rpy")},
            "temperature": float(imu["temperature"]),
        },
        "wireless_remote": base64.b64encode(low["wireless_remote"].tobytes()).decode(),
        "mode_machine": int(low["mode_machine"]),
    }
    return json.dumps({"topic": "rt/lowstate", "data": data}).encode()


class LeRobot:
    """The two sockets of one robot. All calls come from one thread."""

    def __init__(self, address: str) -> None:
        context = zmq.Context.instance()
        self._commands = context.socket(zmq.PULL)
        self._commands.setsockopt(zmq.RCVHWM, 16)
        self._commands.bind(f"tcp://{address}:{COMMAND_PORT}")
        self._states = Publisher(address, STATE_PORT)

    def take(self) -> Record | None:
        """Returns the newest command that has come since the last call."""
        newest: bytes | None = None
        while True:
            try:
                newest = self._commands.recv(zmq.NOBLOCK)
            except zmq.Again:
                return None if newest is None else command_of(newest)

    def publish(self, low: Record) -> None:
        """Tells a `LowState_` if a client listens."""
        if self._states.has_subscribers():
            self._states.send(state_payload(low))


class Publisher:
    """A PUB socket that knows whether anybody listens. All calls come from one thread."""

    def __init__(self, address: str, port: int) -> None:
        self._socket = zmq.Context.instance().socket(zmq.XPUB)
        self._socket.setsockopt(zmq.SNDHWM, 2)
        self._socket.setsockopt(zmq.XPUB_VERBOSER, 1)
        self._socket.bind(f"tcp://{address}:{port}")
        self._subscriptions = 0

    def has_subscribers(self) -> bool:
        """Returns whether a client has subscribed."""
        while True:
            try:
                notice = self._socket.recv(zmq.NOBLOCK)
            except zmq.Again:
                return self._subscriptions > 0
            self._subscriptions += 1 if notice[:1] == b"\x01" else -1

    def send(self, payload: bytes) -> None:
        """Sends to all clients; one that does not keep up misses messages."""
        try:
            self._socket.send(payload, zmq.NOBLOCK)
        except zmq.Again:
            return
