"""LeRobot's protocol for `unitree_g1`: commands and states as JSON over ZMQ, as its `run_g1_server.py` speaks it."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import zmq

from ..wire.joints import MOTORS
from ..wire.layout import LOW_COMMAND, Record, blank
from .sockets import Publisher, bound, received

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
    """Returns the message of a `LowState_`; a motor's temperature is the mean of its two."""
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
        self._commands = bound(zmq.PULL, address, COMMAND_PORT, RCVHWM=16)
        self._states = Publisher(address, STATE_PORT)

    def take(self) -> Record | None:
        """Returns the newest command that has come since the last call."""
        newest: bytes | None = None
        while (payload := received(self._commands)) is not None:
            newest = payload
        return None if newest is None else command_of(newest)

    def publish(self, low: Record) -> None:
        """Sends a `LowState_` if a client listens."""
        if self._states.has_subscribers():
            self._states.send(state_payload(low))
