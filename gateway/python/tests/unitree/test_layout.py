"""Bytes of messages, compared with those of Unitree's own types (`tests/peers/unitree/golden.py`)."""

from __future__ import annotations

import base64
import json
import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tandem
from tandem_unitree.robot.messages import Messages
from tandem_unitree.robot.sensing import Moment
from tandem_unitree.wire.crc import crc32
from tandem_unitree.wire.joints import BODY, HAND_COLUMNS, HANDS, JOINTS, UPPER_BODY, UPPER_BODY_COLUMNS, standing_row
from tandem_unitree.wire.layout import (
    HAND_COMMAND,
    IMU,
    LOW_COMMAND,
    LOW_STATE,
    blank,
    body_of,
    command_crc,
    modes_of,
    serialized,
    state_crc,
)
from tandem_unitree.wire.rpc import Request, response

GOLDEN: dict[str, bytes] = {
    name: zlib.decompress(base64.b64decode(text))
    for name, text in json.loads((Path(__file__).parent / "golden.json").read_text()).items()
}
YAW_RAD = 0.4


def joint_names() -> list[str]:
    """The joints in Tandem's published order."""
    names: list[str] = [name.removesuffix("_rad") for name in tandem._native.state_columns() if name.endswith("_joint_rad")]
    assert len(names) == JOINTS
    return names


def value(name: str) -> float:
    return 0.001 * (zlib.crc32(name.encode()) % 1000)


def golden_moment() -> Moment:
    """Time in the golden messages."""
    q = np.array([value(name) for name in joint_names()])
    return Moment(
        time_s=12.34,
        joints=np.stack([q, q + 1, q + 2, q + 3]),
        quaternion_wxyz=np.array([math.cos(YAW_RAD / 2), 0.0, 0.0, math.sin(YAW_RAD / 2)]),
        position_m=np.array([1.0, 2.0, 0.75]),
        gyro_rad_s=np.array([0.1, 0.2, 0.3]),
        velocity_m_s=np.array([0.1, 0.2, 0.0]),
        fallen=False,
    )


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("low_state", Messages().low_state(golden_moment())),
        ("left_hand_state", Messages().hand_state("left", golden_moment())),
        ("right_hand_state", Messages().hand_state("right", golden_moment())),
        ("battery", Messages().battery),
        ("odometry", Messages().odometry(golden_moment())),
        ("response", response(Request(2**40 + 7, 7105, ""), 3203, '{"data": 1}')),
    ],
)
def test_a_message_has_the_bytes_of_unitrees_types(name: str, message: bytes) -> None:
    golden = GOLDEN[name]
    assert message[: len(golden)] == golden
    assert not any(message[len(golden) :]), "padding at the end"


def test_messages_stay_right_when_they_are_filled_again() -> None:
    messages, moment = Messages(), golden_moment()
    other = Moment(1.0, -moment.joints, *(np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(3)), False)
    messages.low_state(other)
    messages.hand_state("right", other)
    assert messages.low_state(moment) == GOLDEN["low_state"]
    assert messages.hand_state("right", moment) == GOLDEN["right_hand_state"]


def test_imu_has_the_bytes_of_unitrees_type() -> None:
    record = body_of(GOLDEN["imu"] + b"\0\0", IMU)
    assert record is not None
    assert record["quaternion"][3] == np.float32(math.sin(YAW_RAD / 2)) and record["temperature"] == 40
    assert serialized(record)[:58] == GOLDEN["imu"]


def test_checksums_are_those_of_unitrees_library() -> None:
    state, command = body_of(GOLDEN["low_state"], LOW_STATE), body_of(GOLDEN["low_command"], LOW_COMMAND)
    assert state is not None and state["crc"] == state_crc(state)
    assert command is not None and command["crc"] == command_crc(command)


def test_the_checksum_is_its_definition_bit_by_bit() -> None:
    words = [0x12345678, 0x9ABCDEF0, 0, 0xFFFFFFFF, 1]
    register = 0xFFFFFFFF
    for word in words:
        register ^= word
        for _ in range(32):
            register = (register << 1 ^ (0x04C11DB7 if register >> 31 else 0)) & 0xFFFFFFFF
    assert crc32(np.array(words, "<u4").tobytes()) == register


def test_commands_are_read_by_motor() -> None:
    command = body_of(GOLDEN["low_command"], LOW_COMMAND)
    assert command is not None and command["mode_pr"] == 0 and command["mode_machine"] == 5
    assert np.allclose(command["motors"]["q"], 0.01 * np.arange(35))
    assert np.allclose(command["motors"]["kp"], 3.0 + np.arange(35))
    assert modes_of(command).tolist() == [index % 2 for index in range(35)]
    hand = body_of(GOLDEN["hand_command"], HAND_COMMAND)
    assert hand is not None and hand["count"] == 7
    assert np.allclose(hand["motors"]["q"], 0.1 * np.arange(7))
    assert modes_of(hand).tolist() == [index | 1 << 4 for index in range(7)]


def test_padding_of_a_command_does_not_count() -> None:
    message = bytearray(GOLDEN["low_command"])
    for offset in (4 + 3, 4 + 4 + 25, 4 + 4 + 27):
        assert message[offset] == 0
        message[offset] = 0xAA
    command = body_of(bytes(message), LOW_COMMAND)
    assert command is not None and command["crc"] == command_crc(command)


def test_what_cannot_be_read_is_no_message() -> None:
    golden = GOLDEN["low_command"]
    assert body_of(golden[:-4], LOW_COMMAND) is None, "cut off"
    assert body_of(b"\0\0\0\0" + golden[4:], LOW_COMMAND) is None, "big-endian"
    assert Request.of(GOLDEN["request"][:20]) is None
    assert Request.of(GOLDEN["request"]) == Request(2**40 + 7, 7105, '{"velocity": [0.1, 0, 0]}', noreply=True)


def test_joints_have_unitrees_order() -> None:
    names = joint_names()
    fingers = {
        side: [names[int(joint)].removeprefix(f"{side}_hand_").removesuffix("_joint") for joint in joints]
        for side, joints in HANDS.items()
    }
    assert fingers["right"] == ["thumb_0", "thumb_1", "thumb_2", "index_0", "index_1", "middle_0", "middle_1"]
    assert fingers["left"] == ["thumb_0", "thumb_1", "thumb_2", "middle_0", "middle_1", "index_0", "index_1"]
    columns = tandem._native.action_columns()
    by_motor = dict(zip(UPPER_BODY.tolist(), UPPER_BODY_COLUMNS.tolist(), strict=True))
    for motor, column in by_motor.items():
        assert names[BODY[motor]] in columns[column]
    for side, hand in HANDS.items():
        for joint, column in zip(hand.tolist(), HAND_COLUMNS[side].tolist(), strict=True):
            assert names[joint] in columns[column]


def test_a_standing_row_keeps_every_joint() -> None:
    names, columns = joint_names(), tandem._native.action_columns()
    row = standing_row(np.arange(JOINTS, dtype=float), 0.75)
    for column, target in zip(columns[:31], row[:31].tolist(), strict=True):
        [joint] = [name for name in names if name in column]
        assert target == names.index(joint)
    assert row[31:].tolist() == [0, 0, 0, 0.75]


def test_fingers_are_never_exactly_at_zero() -> None:
    still: Any = Moment(0.0, np.zeros((4, JOINTS)), np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3), np.zeros(3), False)
    angles = np.frombuffer(Messages().hand_state("left", still)[4 + 8 : 4 + 8 + 4], "<f4")
    assert 0 < angles[0] < 1e-4


def test_blank_messages_are_zeros() -> None:
    assert not any(blank(LOW_STATE).tobytes())
