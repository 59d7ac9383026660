"""Commands of a robot's programs, and the action row that follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..wire.joints import (
    BASE_COLUMNS,
    BODY,
    BODY_MOTORS,
    HAND_COLUMNS,
    HANDS,
    JOINTS,
    LEGS,
    PARALLEL_WAIST,
    UPPER_BODY,
    UPPER_BODY_COLUMNS,
    WEIGHT_MOTOR,
)
from ..wire.layout import HAND_COMMAND, HAND_MOTORS, LOW_COMMAND, Record, body_of, command_crc, modes_of
from .messages import ENABLED, MODE_MACHINE, SERIES_ANKLE
from .remarks import Remarks

RELEASED = ""
"""Name of the mode in which `rt/lowcmd` drives the joints."""

DRIVE_FIELDS = ("q", "dq", "kp", "kd", "tau")
"""Blocks of a row of motor setpoints, each with a number for each joint, by their names in a motor's command."""

IDLE_FINGER = {"kp": 2.0, "kd": 0.06}
"""Gains of a finger that no program commands while programs drive the motors."""

FACTORY_MODE = "ai"
"""Name of the mode in which the motion controller of the factory walks and `rt/arm_sdk` moves the arms."""


@dataclass(frozen=True)
class BaseRange:
    """The base commands that locomotion accepts."""

    vx_m_s: tuple[float, float] = (-0.3, 0.4)
    vy_m_s: tuple[float, float] = (-0.3, 0.3)
    yaw_rate_rad_s: tuple[float, float] = (-0.5, 0.5)
    pelvis_height_m: tuple[float, float] = (0.5, 0.76)


class Commands:
    """The commands in force of one robot.

    standing: The action row of the pose in which the robot was found; a joint that no program commands keeps it.
    joint_control: True if `rt/lowcmd` drives every motor with its own gains, legs included.
    """

    def __init__(
        self,
        standing: NDArray[np.float64],
        limits: BaseRange,
        remarks: Remarks,
        *,
        released: bool = False,
        joint_control: bool = False,
    ) -> None:
        self.limits = limits
        self.remarks = remarks
        self.joint_control = joint_control
        self.mode = RELEASED if released else FACTORY_MODE
        self.bad_crcs = 0
        self.height_share = 1.0
        self._velocity = np.zeros(3)
        self._until_s = -np.inf
        self._low: Record | None = None
        self._arm: Record | None = None
        self.stand(standing)

    def stand(self, standing: NDArray[np.float64]) -> None:
        """Forgets all commands; the robot keeps the pose `standing`, as at the beginning of an episode."""
        self._rest: NDArray[np.float64] = np.array(standing)
        self._low = self._arm = None
        self._fingers: dict[str, Record] = {}
        self._until_s = -np.inf

    def select_mode(self, name: str) -> None:
        """Selects the factory's mode, or releases it. Joints keep the pose that was commanded last."""
        if name != self.mode:
            self._rest = self.row(-np.inf)
            self._low = self._arm = None
            self._velocity = np.zeros(3)
        self.mode = name

    def low_command(self, message: bytes) -> bool:
        """Takes a serialized `LowCmd_` of `rt/lowcmd`; returns whether its checksum is right."""
        record = self._checked(message, "rt/lowcmd")
        if record is None:
            return False
        self.low_record(record)
        return True

    def low_record(self, record: Record) -> None:
        """Takes a `LowCmd_` of `rt/lowcmd` that needs no checksum."""
        if self.mode != RELEASED:
            self.remarks.once("rt/lowcmd is ignored until the motion_switcher releases the mode (ReleaseMode)")
            return
        motors = record["motors"]
        if record["mode_machine"] != MODE_MACHINE:
            self.remarks.once(f"rt/lowcmd should have mode_machine {MODE_MACHINE}, as LowState_ has; a G1 may not move without")
        if not self.joint_control:
            if (motors["kp"][LEGS] > 0).any() or (motors["tau"][LEGS] != 0).any():
                self.remarks.once(
                    "rt/lowcmd moves the waist and the arms; the legs stay with the simulator's balance controller, "
                    "unless the bridge has --joint-control"
                )
            self._say_ignored_gains(record, "rt/lowcmd")
        self._low = record

    def arm_command(self, message: bytes) -> bool:
        """Takes a serialized `LowCmd_` of `rt/arm_sdk`; returns whether its checksum is right."""
        record = self._checked(message, "rt/arm_sdk")
        if record is None:
            return False
        if self.mode == RELEASED:
            self.remarks.once("rt/arm_sdk is ignored while the mode is released; use rt/lowcmd, or select the mode 'ai'")
            return True
        self._say_ignored_gains(record, "rt/arm_sdk")
        self._arm = record
        return True

    def hand_command(self, side: str, message: bytes) -> bool:
        """Takes a serialized `HandCmd_`; returns whether it has the 7 motors of a Dex3-1."""
        record = body_of(message, HAND_COMMAND)
        if record is None or record["count"] != HAND_MOTORS:
            self.remarks.once(f"rt/dex3/{side}/cmd is ignored if it does not have {HAND_MOTORS} motors, as a Dex3-1 does")
            return False
        motors = record["motors"]
        driven = motors["kp"] > 0
        self._fingers[side] = record
        if not self.joint_control and (motors["tau"] != 0).any():
            self.remarks.once("rt/dex3/*/cmd: kp, kd, dq and tau are ignored; fingers have the gains of the simulator's drives")
        self._rest[HAND_COLUMNS[side][driven]] = _finite(motors["q"], self._rest[HAND_COLUMNS[side]])[driven]
        return True

    def walk(self, velocity: tuple[float, float, float], until_s: float) -> None:
        """Walks with vx [m/s], vy [m/s] and yaw rate [rad/s] until the simulated time `until_s`."""
        ranges = (self.limits.vx_m_s, self.limits.vy_m_s, self.limits.yaw_rate_rad_s)
        wanted = np.array(velocity, dtype=np.float64)
        low, high = ([float(limits[end]) for limits in ranges] for end in (0, 1))
        self._velocity = np.minimum(np.maximum(wanted, low), high)
        if not np.array_equal(wanted, self._velocity):
            self.remarks.once(f"velocities are limited to {low} .. {high} (vx m/s, vy m/s, yaw rad/s)")
        self._until_s = until_s

    def walks(self, time_s: float) -> bool:
        """Returns whether a velocity other than zero is in force at a simulated time."""
        return time_s < self._until_s and bool(self._velocity.any())

    def drives(self) -> NDArray[np.float64] | None:
        """Returns the setpoints of all motors in force, 5 by 43 as `DRIVE_FIELDS` has them; `None` while the simulator's own
        controller drives the robot: without joint control, before the mode is released, and before the first `rt/lowcmd`.

        A motor of the body that is disabled exerts nothing, as on a G1. Fingers that no program commands keep their pose.
        """
        if not self.joint_control or self.mode != RELEASED or self._low is None:
            return None
        if self._low["mode_pr"] != SERIES_ANKLE:
            self.remarks.once("mode_pr 1 (parallel ankles and waist, A and B) cannot be simulated: rt/lowcmd is ignored")
            return None
        rows = np.zeros((len(DRIVE_FIELDS), JOINTS))
        enabled = modes_of(self._low)[:BODY_MOTORS] == ENABLED
        for row, field in zip(rows, DRIVE_FIELDS, strict=True):
            row[BODY] = np.where(enabled, _finite(self._low["motors"][field][:BODY_MOTORS], np.zeros(BODY_MOTORS)), 0.0)
        for side, joints in HANDS.items():
            record = self._fingers.get(side)
            idle = {"q": self._rest[HAND_COLUMNS[side]], **IDLE_FINGER}
            driven = np.zeros(HAND_MOTORS, dtype=bool) if record is None else record["motors"]["kp"] > 0
            for row, field in zip(rows, DRIVE_FIELDS, strict=True):
                given = np.zeros(HAND_MOTORS, dtype=np.float32) if record is None else record["motors"][field]
                row[joints] = np.where(driven, _finite(given, np.zeros(HAND_MOTORS)), idle.get(field, 0.0))
        rows[2:4] = np.maximum(rows[2:4], 0.0)
        return rows

    def row(self, time_s: float) -> NDArray[np.float64]:
        """Returns the action row in force at a simulated time."""
        row: NDArray[np.float64] = np.array(self._rest)
        if self._low is not None:
            self._take(row, self._low, 1.0, needs_mode=True)
        elif self._arm is not None:
            weight = float(self._arm["motors"]["q"][WEIGHT_MOTOR])
            self._take(row, self._arm, min(max(weight, 0.0), 1.0) if np.isfinite(weight) else 0.0, needs_mode=False)
        low, high = self.limits.pelvis_height_m
        velocity = self._velocity if time_s < self._until_s else np.zeros(3)
        row[BASE_COLUMNS] = [*velocity, low + self.height_share * (high - low)]
        return row

    def _take(self, row: NDArray[np.float64], record: Record, weight: float, *, needs_mode: bool) -> None:
        """Moves the commanded joints of `row` towards the targets by `weight`: q = w q_command + (1 - w) q_rest."""
        motors = record["motors"][UPPER_BODY]
        driven = (motors["kp"] > 0) & np.isfinite(motors["q"])
        if needs_mode:
            driven &= modes_of(record)[UPPER_BODY] == ENABLED
        if record["mode_pr"] != SERIES_ANKLE:
            self.remarks.once(
                "mode_pr 1 (parallel ankles and waist, A and B) cannot be simulated: waist roll and pitch are ignored"
            )
            driven &= ~np.isin(UPPER_BODY, PARALLEL_WAIST)
        columns = UPPER_BODY_COLUMNS[driven]
        row[columns] += weight * (motors["q"][driven] - row[columns])

    def _checked(self, message: bytes, topic: str) -> Record | None:
        """Returns the record of a `LowCmd_`, or `None` if its checksum is wrong, as a G1 drops it."""
        record = body_of(message, LOW_COMMAND)
        if record is None or record["crc"] != command_crc(record):
            self.bad_crcs += 1
            self.remarks.once(f"{topic}: a command with a wrong checksum (crc) was dropped, as on a G1")
            return None
        return record

    def _say_ignored_gains(self, record: Record, topic: str) -> None:
        motors = record["motors"][UPPER_BODY]
        if (motors["kp"] > 0).any() or (motors["tau"] != 0).any() or (motors["dq"] != 0).any():
            self.remarks.once(
                f"{topic}: q is followed; kp, kd, dq and tau are ignored, since drives keep the simulator's gains"
            )


def _finite(values: NDArray[np.float32], otherwise: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.isfinite(values), values, otherwise)
