"""Poses as 4x4 matrices, and their formats in files."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..files import Array, numbers


def identity() -> Array:
    return np.eye(4)


def inverse(pose: Array) -> Array:
    turned_back = pose[:3, :3].T
    inverted = np.eye(4)
    inverted[:3, :3], inverted[:3, 3] = turned_back, -turned_back @ pose[:3, 3]
    return inverted


def rotation_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Returns the rotation about the fixed axes x, y and z, in this order, by angles in radians."""
    return about("z", yaw) @ about("y", pitch) @ about("x", roll)


def about(axis: str, angle_rad: float) -> Array:
    return rotation_about(np.eye(3)["xyz".index(axis)], angle_rad)


def rotation_about(axis: Any, angle_rad: float) -> Array:
    """Returns the rotation about an axis by Rodrigues' formula; an axis of length 0 turns nothing."""
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        return np.eye(3)
    x, y, z = np.asarray(axis, dtype=float) / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * cross @ cross


def pose(translation: Any, rotation: Any = None) -> Array:
    made = np.eye(4)
    made[:3, 3] = translation
    if rotation is not None:
        made[:3, :3] = rotation
    return made


def attributes(of: Array) -> str:
    """Returns a pose as the attributes `pos` and `quat` of MJCF."""
    return f'pos="{numbers(of[:3, 3])}" quat="{numbers(quaternion(of[:3, :3]))}"'


def quaternion(rotation: Array) -> Array:
    """Returns the quaternion w, x, y, z of a rotation matrix: the eigenvector of its largest eigenvalue (Bar-Itzhack 2000)."""
    r: Any = rotation
    symmetric = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    found: Any = np.linalg.eigh(symmetric)[1][:, -1]
    return found if found[0] >= 0 else -found
