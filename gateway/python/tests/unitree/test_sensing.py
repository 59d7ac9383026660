"""Rates and orientations, compared with finite differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tandem_unitree.robot.sensing import (
    Moment,
    Vector,
    moment_of,
    product,
    rate_between,
    resting_force,
    roll_pitch_yaw,
    rotation,
    torso_of,
)


def quaternion(roll: float, pitch: float, yaw: float) -> Vector:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = (
        np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.eye(3)[axis])]) for axis, angle in enumerate((roll, pitch, yaw))
    )
    return product(product(z, y), x)


def moment(joints: np.ndarray[Any, np.dtype[np.float64]], pelvis: Vector, gyro: Vector, time_s: float = 0.0) -> Moment:
    return Moment(time_s, joints, pelvis, np.zeros(3), gyro, np.zeros(3), False)


def state(time_s: float, q_rad: float, yaw_rad: float, **left_out: None) -> dict[str, Any]:
    """A reply of `get_robot_state`."""
    names = [f"joint_{index}" for index in range(43)]
    told = {
        "time_s": time_s,
        "joint_positions_rad": dict.fromkeys(names, q_rad),
        "joint_velocities_rad_s": dict.fromkeys(names, 0.5),
        "joint_torques_n_m": dict.fromkeys(names, 3.0),
        "pelvis_in_start": {"position_m": [time_s, 0.0, 0.75], "quaternion_wxyz": quaternion(0, 0, yaw_rad).tolist()},
        "fallen": False,
    }
    return {name: value for name, value in told.items() if name not in left_out}


def test_angles_come_back() -> None:
    for angles in ((0.1, -0.2, 0.3), (-1.0, 0.5, 2.5), (0.0, 0.0, 0.0)):
        assert np.allclose(roll_pitch_yaw(quaternion(*angles)), angles)


def test_a_rotation_turns_as_its_quaternion() -> None:
    turn = rotation(quaternion(0.0, 0.0, np.pi / 2))
    assert np.allclose(turn @ [1, 0, 0], [0, 1, 0])
    assert np.allclose(resting_force(quaternion(np.pi / 2, 0, 0)), [0, 9.81, 0])


def test_a_rate_is_what_turned_the_frame() -> None:
    before, rate = quaternion(0.3, -0.4, 1.0), np.array([0.2, -0.5, 0.7])
    turn = np.array([1.0, *(0.5 * 1e-4 * rate)])
    assert np.allclose(rate_between(before, product(before, turn), 1e-4), rate, atol=1e-6)
    assert np.allclose(rate_between(before, -product(before, turn), 1e-4), rate, atol=1e-6), "the same orientation"


def test_the_torso_turns_as_the_difference_of_its_orientations() -> None:
    joints = np.zeros((4, 43))
    joints[0, 12:15], joints[1, 12:15] = [0.4, -0.3, 0.2], [0.5, 0.7, -0.6]
    pelvis, gyro, step_s = quaternion(0.1, 0.2, 0.3), np.array([0.3, -0.1, 0.2]), 1e-5
    orientation, rate = torso_of(moment(joints, pelvis, gyro))
    later = np.array(joints)
    later[0] += step_s * joints[1]
    turned = product(pelvis, np.array([1.0, *(0.5 * step_s * gyro)]))
    after, _ = torso_of(moment(later, turned / np.linalg.norm(turned), gyro))
    assert np.allclose(rate, rate_between(orientation, after, step_s), atol=1e-4)


def test_samples_are_played_back_between_control_steps() -> None:
    told = state(1.02, 0.3, 0.0)
    rows = [[0.1 * (sample + 1)] * 43 for sample in range(4)]
    told["samples"] = {
        "joint_positions_rad": rows,
        "joint_velocities_rad_s": rows,
        "joint_torques_n_m": rows,
        "gyro_rad_s": [[0.0, 0.0, float(sample)] for sample in range(4)],
        "specific_force_m_s2": [[0.0, float(sample), 9.81] for sample in range(4)],
    }
    first = moment_of(state(1.0, 0.0, 0.0), None)
    later = moment_of(told, first)
    assert later.gyro_rad_s.tolist() == [0.0, 0.0, 3.0] and later.accelerometer_m_s2.tolist() == [0.0, 3.0, 9.81]
    between = first.until(later, 0.3)
    assert np.allclose(between.joints[[0, 1, 3]], 0.2) and between.gyro_rad_s[2] == 1.0
    assert between.accelerometer_m_s2.tolist() == [0.0, 1.0, 9.81]
    assert np.allclose(first.accelerometer_m_s2, [0.0, 0.0, 9.81]), "without samples, gravity alone"


def test_a_reply_becomes_a_moment() -> None:
    first = moment_of(state(1.0, 0.1, 0.0), None)
    second = moment_of(state(1.02, 0.2, 0.01), first)
    assert np.allclose(second.joints[:, 7], [0.2, 0.5, 0.0, 3.0])
    assert np.allclose(second.gyro_rad_s, [0, 0, 0.5], atol=1e-3)
    assert np.allclose(second.velocity_m_s, [1.0, 0, 0])


def test_what_a_reply_leaves_out_comes_from_differences_or_is_nothing() -> None:
    left_out: dict[str, None] = dict.fromkeys(("joint_velocities_rad_s", "joint_torques_n_m", "pelvis_in_start"))
    first = moment_of(state(1.0, 0.1, 0.0, **left_out), None)
    second = moment_of(state(1.02, 0.2, 0.01, **left_out), first)
    assert np.allclose(second.joints[:, 0], [0.2, 5.0, 250.0, 0.0])
    assert second.quaternion_wxyz.tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_between_two_moments(share: float) -> None:
    joints = np.ones((4, 43))
    first = moment(0 * joints, quaternion(0, 0, 0.0), np.zeros(3), 1.0)
    later = moment(joints, -quaternion(0, 0, 0.2), np.ones(3), 1.02)
    between = first.until(later, share)
    assert between.joints[0, 0] == share and np.isclose(between.time_s, 1.0 + 0.02 * share)
    assert np.isclose(roll_pitch_yaw(between.quaternion_wxyz)[2], 0.2 * share, atol=1e-3)
