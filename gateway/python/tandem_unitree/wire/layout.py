"""Serialized messages as NumPy records: the bytes of CDR, little-endian, after their header of 4 bytes.

All messages here have a fixed size, since their sequences have a fixed length, so one assignment fills a field of all
motors at once. CDR aligns numbers and not structures: the mode of the first motor directly follows what is before it. A
motor's record therefore begins at its `q` and ends with the mode of the next motor.
Sources: the IDL of unitree_sdk2 (unitree_hg, unitree_go) and Plain CDR, version 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .crc import crc32
from .joints import MOTORS

HEADER = b"\x00\x01\x00\x00"
"""Header of Plain CDR, little-endian, which both versions of the encoding may use for these messages."""

Record = NDArray[Any]
"""One message: an array without dimensions whose type is one of the records below."""


def _record(size: int, **fields: tuple[int, Any]) -> np.dtype[Any]:
    """Returns a record of `size` bytes, each field at its offset."""
    offsets, formats = zip(*fields.values(), strict=True)
    return np.dtype({"names": list(fields), "formats": list(formats), "offsets": list(offsets), "itemsize": size})


def _words(offset: int, count: int, kind: str = "<f4") -> tuple[int, Any]:
    return offset, (kind, (count,))


MOTOR_COMMAND = _record(
    28, q=(0, "<f4"), dq=(4, "<f4"), tau=(8, "<f4"), kp=(12, "<f4"), kd=(16, "<f4"), reserve=(20, "<u4"), next_mode=(24, "u1")
)
"""`MotorCmd_` of unitree_hg from its `q` on, with the mode of the motor after it."""

LOW_COMMAND = _record(
    1000,
    mode_pr=(0, "u1"),
    mode_machine=(1, "u1"),
    first_mode=(2, "u1"),
    motors=(4, (MOTOR_COMMAND, (MOTORS,))),
    reserve=_words(980, 4, "<u4"),
    crc=(996, "<u4"),
)
"""`LowCmd_` of unitree_hg. The last motor's `next_mode` overlaps `reserve` and stays unused."""

HAND_MOTORS = 7
"""Motors of a Dex3-1."""

HAND_COMMAND = _record(
    216,
    count=(0, "<u4"),
    first_mode=(4, "u1"),
    motors=(8, (MOTOR_COMMAND, (HAND_MOTORS,))),
    reserve=_words(200, 4, "<u4"),
)
"""`HandCmd_` of unitree_hg with 7 motors. The last motor's `next_mode` overlaps `reserve` and stays unused."""

MOTOR_STATE = _record(
    56,
    q=(0, "<f4"),
    dq=(4, "<f4"),
    ddq=(8, "<f4"),
    tau_est=(12, "<f4"),
    temperature=_words(16, 2, "<i2"),
    vol=(20, "<f4"),
    sensor=_words(24, 2, "<u4"),
    motorstate=(32, "<u4"),
    reserve=_words(36, 4, "<u4"),
    next_mode=(52, "u1"),
)
"""`MotorState_` of unitree_hg from its `q` on, with the mode of the motor after it."""

IMU = _record(
    56,
    quaternion=_words(0, 4),
    gyroscope=_words(16, 3),
    accelerometer=_words(28, 3),
    rpy=_words(40, 3),
    temperature=(52, "<i2"),
)
"""`IMUState_` of unitree_hg, with the padding that follows it at the end of a message."""

LOW_STATE = _record(
    2088,
    version=_words(0, 2, "<u4"),
    mode_pr=(8, "u1"),
    mode_machine=(9, "u1"),
    tick=(12, "<u4"),
    imu=(16, IMU),
    first_mode=(70, "u1"),
    motors=(72, (MOTOR_STATE, (MOTORS,))),
    wireless_remote=(2028, ("u1", (40,))),
    reserve=_words(2068, 4, "<u4"),
    crc=(2084, "<u4"),
)
"""`LowState_` of unitree_hg. The last motor's `next_mode` overlaps `wireless_remote` and stays unused."""

PRESS_SENSORS = 9
"""Pressure sensors of a Dex3-1."""

PRESS_SENSOR = _record(104, pressure=_words(0, 12), temperature=_words(48, 12), lost=(96, "<u4"), reserve=(100, "<u4"))
"""`PressSensorState_` of unitree_hg."""

HAND_STATE = _record(
    1424,
    motor_count=(0, "<u4"),
    first_mode=(4, "u1"),
    motors=(8, (MOTOR_STATE, (HAND_MOTORS,))),
    press_count=(396, "<u4"),
    press_sensors=(400, (PRESS_SENSOR, (PRESS_SENSORS,))),
    imu=(1336, IMU),
    power_v=(1392, "<f4"),
    power_a=(1396, "<f4"),
    system_v=(1400, "<f4"),
    device_v=(1404, "<f4"),
    error=_words(1408, 2, "<u4"),
    reserve=_words(1416, 2, "<u4"),
)
"""`HandState_` of unitree_hg with 7 motors and 9 sensors. The last `next_mode` overlaps `press_count` and stays unused."""

BATTERY = _record(
    164,
    version_high=(0, "u1"),
    version_low=(1, "u1"),
    fn=(2, "u1"),
    cell_vol=_words(4, 40, "<u2"),
    bmsvoltage=_words(84, 3, "<u4"),
    current=(96, "<i4"),
    soc=(100, "u1"),
    soh=(101, "u1"),
    temperature=_words(102, 12, "<i2"),
    cycle=(126, "<u2"),
    manufacturer_date=(128, "<u2"),
    bmsstate=_words(132, 5, "<u4"),
    reserve=_words(152, 3, "<u4"),
)
"""`BmsState_` of unitree_hg."""

ODOMETRY = _record(
    512,
    sec=(0, "<i4"),
    nanosec=(4, "<u4"),
    error_code=(8, "<u4"),
    quaternion=_words(12, 4),
    gyroscope=_words(28, 3),
    accelerometer=_words(40, 3),
    rpy=_words(52, 3),
    temperature=(64, "u1"),
    mode=(65, "u1"),
    progress=(68, "<f4"),
    gait_type=(72, "u1"),
    foot_raise_height=(76, "<f4"),
    position=_words(80, 3),
    body_height=(92, "<f4"),
    velocity=_words(96, 3),
    yaw_speed=(108, "<f4"),
    range_obstacle=_words(112, 4),
    foot_force=_words(128, 4, "<i2"),
    foot_position_body=_words(136, 12),
    foot_speed_body=_words(184, 12),
    path_point=_words(232, 70),
)
"""`SportModeState_` of unitree_go, with its `IMUState_` in place."""


def blank(kind: np.dtype[Any]) -> Record:
    """Returns a message of zeros."""
    return np.zeros((), kind)


def body_of(message: bytes, kind: np.dtype[Any]) -> Record | None:
    """Returns the record in a serialized message; `None` if it is big-endian or shorter than the record."""
    body = message[len(HEADER) :]
    if message[1:2] not in (b"\x01", b"\x07") or len(body) < kind.itemsize:
        return None
    return np.frombuffer(body, kind, 1)[0]


def serialized(record: Record) -> bytes:
    """Returns the message with its header."""
    return HEADER + record.tobytes()


def modes_of(record: Record) -> NDArray[np.uint8]:
    """Returns the mode of each motor in a command."""
    return np.concatenate(([record["first_mode"]], record["motors"]["next_mode"][:-1]))


def _command_mask() -> NDArray[np.uint8]:
    """Returns ones where a `LowCmd_` has data and zeros where it has padding, whose bytes a sender may leave undefined."""
    mask = np.full(LOW_COMMAND.itemsize, 0xFF, np.uint8)
    mask[3] = 0
    motors = np.reshape(mask[4 : 4 + MOTORS * MOTOR_COMMAND.itemsize], (MOTORS, MOTOR_COMMAND.itemsize))
    motors[:-1, 25:] = 0
    return mask


_COMMAND_MASK = _command_mask()


def command_crc(record: Record) -> int:
    """Returns the checksum that a `LowCmd_` should have. Its C structure begins the first motor with its mode, aligned to 4."""
    body = (np.frombuffer(record.tobytes(), np.uint8) & _COMMAND_MASK).tobytes()
    return crc32(body[:2] + b"\0\0" + body[2:4] + b"\0\0" + body[4:-4])


def state_crc(record: Record) -> int:
    """Returns the checksum that a `LowState_` should have.

    The C structure pads the IMU to 56 bytes and begins the first motor with its mode, which takes 4 bytes more than CDR.
    """
    body = record.tobytes()
    return crc32(body[:70] + b"\0\0" + body[70:72] + b"\0\0" + body[72:-4])
