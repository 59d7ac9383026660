"""Joints, orientation and odometry of a robot from replies of `get_robot_state`, with the rates that an IMU measures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..wire.joints import JOINTS

Vector = NDArray[np.float64]

GRAVITY_M_S2 = 9.81

STEP_S = 0.02
"""A control step."""


@dataclass(frozen=True)
class Samples:
    """Readings of a robot's sensors every 5 ms in a control step, oldest first."""

    joints: NDArray[np.float64]
    """N by 3 by 43: angle, velocity and torque of each joint."""

    gyro_rad_s: NDArray[np.float64]
    """N by 3: angular velocity of the pelvis in its own frame."""

    specific_force_m_s2: NDArray[np.float64]
    """N by 3: specific force at the IMU in the pelvis frame."""

    @classmethod
    def of(cls, told: Mapping[str, Any]) -> Samples:
        """Returns the samples in a reply."""
        columns = ("joint_positions_rad", "joint_velocities_rad_s", "joint_torques_n_m")
        joints = np.stack([np.array(told[column], np.float64) for column in columns], axis=1)
        return cls(joints, np.array(told["gyro_rad_s"], np.float64), np.array(told["specific_force_m_s2"], np.float64))


@dataclass(frozen=True)
class Moment:
    """State of a robot at one control step."""

    time_s: float
    """Simulated seconds since the episode began."""

    joints: NDArray[np.float64]
    """4 by 43: angle, velocity, acceleration and torque of each joint."""

    quaternion_wxyz: Vector
    """Orientation of the pelvis in the start frame."""

    position_m: Vector
    """Position of the pelvis in the start frame."""

    gyro_rad_s: Vector
    """Angular velocity of the pelvis in its own frame: the gyroscope's, or without samples the mean of the last step."""

    velocity_m_s: Vector
    """Velocity of the pelvis in the start frame, averaged over the last control step."""

    fallen: bool
    """True if the robot has fallen."""

    samples: Samples | None = None
    """Readings since the last control step; `None` where they are not told."""

    specific_force_m_s2: Vector | None = None
    """Specific force at the IMU in the pelvis frame; `None` where it is not told."""

    @property
    def accelerometer_m_s2(self) -> Vector:
        """Specific force that the accelerometer measures; where it is not told, that of a pelvis at rest: gravity alone."""
        return resting_force(self.quaternion_wxyz) if self.specific_force_m_s2 is None else self.specific_force_m_s2

    def until(self, later: Moment, share: float) -> Moment:
        """Returns the moment between this one and `later`; `share` runs from 0 (this one) to 1 (`later`).

        Sensors show the last sample before that moment. Without samples, joints are interpolated.
        """
        if share >= 1.0:
            return later
        joints = self.joints + share * (later.joints - self.joints)
        gyro, force = later.gyro_rad_s, later.specific_force_m_s2
        if later.samples is not None:
            sample = int(share * len(later.samples.joints))
            joints[[0, 1, 3]] = later.samples.joints[sample]
            gyro, force = later.samples.gyro_rad_s[sample], later.samples.specific_force_m_s2[sample]
        aligned = later.quaternion_wxyz if self.quaternion_wxyz @ later.quaternion_wxyz >= 0 else -later.quaternion_wxyz
        mixed = self.quaternion_wxyz + share * (aligned - self.quaternion_wxyz)
        return Moment(
            time_s=self.time_s + share * (later.time_s - self.time_s),
            joints=joints,
            quaternion_wxyz=mixed / math.sqrt(mixed @ mixed),
            position_m=self.position_m + share * (later.position_m - self.position_m),
            gyro_rad_s=gyro,
            velocity_m_s=later.velocity_m_s,
            fallen=later.fallen,
            specific_force_m_s2=force,
        )


def moment_of(state: Mapping[str, Any], before: Moment | None) -> Moment:
    """Returns the moment that a reply of `get_robot_state` describes.

    Velocities and accelerations come from the difference to `before`. Under the assistance "paper" a reply has neither
    velocities nor torques nor odometry: velocities come from differences, torques are zero and the pelvis seems to stand
    upright at its start.
    """
    time_s = float(state["time_s"])
    step_s = STEP_S if before is None or time_s <= before.time_s else time_s - before.time_s
    q = _row(state["joint_positions_rad"])
    told = state.get("joint_velocities_rad_s")
    q_before, dq_before = (q, np.zeros(JOINTS)) if before is None else (before.joints[0], before.joints[1])
    dq = (q - q_before) / step_s if told is None else _row(told)
    ddq = np.zeros(JOINTS) if before is None else (dq - dq_before) / step_s
    torques = state.get("joint_torques_n_m")
    tau = np.zeros(JOINTS) if torques is None else _row(torques)
    pose = state.get("pelvis_in_start")
    quaternion = np.array([1.0, 0.0, 0.0, 0.0] if pose is None else pose["quaternion_wxyz"])
    position = np.zeros(3) if pose is None else np.array(pose["position_m"])
    still = np.zeros(3)
    samples = Samples.of(state["samples"]) if state.get("samples") else None
    if samples is not None:
        gyro = samples.gyro_rad_s[-1]
    else:
        gyro = still if before is None else rate_between(before.quaternion_wxyz, quaternion, step_s)
    return Moment(
        time_s=time_s,
        joints=np.stack([q, dq, ddq, tau]),
        quaternion_wxyz=quaternion,
        position_m=position,
        gyro_rad_s=gyro,
        velocity_m_s=still if before is None else (position - before.position_m) / step_s,
        fallen=bool(state.get("fallen", False)),
        samples=samples,
        specific_force_m_s2=None if samples is None else samples.specific_force_m_s2[-1],
    )


def _row(by_joint: Mapping[str, float]) -> Vector:
    return np.fromiter(by_joint.values(), np.float64, JOINTS)


def product(a: Vector, b: Vector) -> Vector:
    """Returns the quaternion a b."""
    w, x, y, z = a.tolist()
    v, p, q, r = b.tolist()
    return np.array(
        [
            w * v - x * p - y * q - z * r,
            w * p + x * v + y * r - z * q,
            w * q - x * r + y * v + z * p,
            w * r + x * q - y * p + z * v,
        ]
    )


def rate_between(before: Vector, after: Vector, step_s: float) -> Vector:
    """Returns the angular velocity in the moving frame that turns `before` to `after` in `step_s`: 2 vec(a* b) / dt."""
    turn = product(before * np.array([1.0, -1.0, -1.0, -1.0]), after)
    return (2.0 if turn[0] >= 0 else -2.0) * turn[1:] / step_s


def rotation(quaternion: Vector) -> NDArray[np.float64]:
    """Returns the rotation matrix R of a quaternion: `R.T @ v` is a vector of the start frame in the rotated frame."""
    w, x, y, z = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def resting_force(quaternion: Vector) -> Vector:
    """Returns the specific force of a body at rest in its own frame, [m/s^2]: gravity alone."""
    return GRAVITY_M_S2 * rotation(quaternion)[2]


def roll_pitch_yaw(quaternion: Vector) -> tuple[float, float, float]:
    """Returns roll, pitch and yaw with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    w, x, y, z = quaternion.tolist()
    return (
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0)),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def torso_of(moment: Moment) -> tuple[Vector, Vector]:
    """Returns orientation and angular velocity of the torso, which the waist turns by yaw, then roll, then pitch.

    With W = Rz Rx Ry: torso = pelvis W, and its rate is W^T w + (Rx Ry)^T z yaw' + Ry^T x roll' + y pitch'.
    """
    yaw, roll, pitch = (0.5 * moment.joints[0, 12:15]).tolist()
    yaw_rate, roll_rate, pitch_rate = moment.joints[1, 12:15].tolist()
    about_z = np.array([math.cos(yaw), 0.0, 0.0, math.sin(yaw)])
    about_x = np.array([math.cos(roll), math.sin(roll), 0.0, 0.0])
    about_y = np.array([math.cos(pitch), 0.0, math.sin(pitch), 0.0])
    tilt = product(about_x, about_y)
    waist = product(about_z, tilt)
    rate = moment.gyro_rad_s @ rotation(waist) + yaw_rate * rotation(tilt)[2] + roll_rate * rotation(about_y)[0]
    rate[1] += pitch_rate
    return product(moment.quaternion_wxyz, waist), rate
