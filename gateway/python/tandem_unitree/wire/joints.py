"""The order of joints on Unitree's topics, as indices into Tandem's 43 joints and into the 35 columns of an action row.

Tandem's published order is left leg 6, right leg 6, waist 3, left arm 7, left hand 7, right arm 7, right hand 7. Within each
limb both orders agree, except for the right hand: Unitree lists its index finger before its middle finger.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

JOINTS = 43
"""Joints of a robot in Tandem's published order."""

MOTORS = 35
"""Motors in `LowState_` and `LowCmd_`; a G1 with 29 degrees of freedom uses the first 29."""

BODY_MOTORS = 29
"""Motors of the body: legs 0-11, waist 12-14, left arm 15-21, right arm 22-28."""

WEIGHT_MOTOR = 29
"""Motor of `rt/arm_sdk` whose `q` is the weight of the command, from 0 to 1."""

LEGS = range(12)
"""Motors of both legs."""

PARALLEL_WAIST = (13, 14)
"""Waist motors that mean roll and pitch in the series mode, and the two rods A and B in the parallel mode."""

BODY: NDArray[np.intp] = np.array([*range(15), *range(15, 22), *range(29, 36)])
"""Joint of each body motor."""

HANDS: dict[str, NDArray[np.intp]] = {
    "left": np.arange(22, 29),
    "right": np.array([36, 37, 38, 41, 42, 39, 40]),
}
"""Joint of each motor of a Dex3-1: thumb 0 1 2, then middle 0 1, index 0 1 (left) or index 0 1, middle 0 1 (right)."""

UPPER_BODY: NDArray[np.intp] = np.arange(12, 29)
"""Motors that a command moves: the waist and both arms."""

UPPER_BODY_COLUMNS: NDArray[np.intp] = np.array([28, 29, 30, *range(14)])
"""Column of an action row for each motor of `UPPER_BODY`."""

HAND_COLUMNS: dict[str, NDArray[np.intp]] = {
    "left": np.arange(14, 21),
    "right": np.array([21, 22, 23, 26, 27, 24, 25]),
}
"""Column of an action row for each motor of a hand."""

ROW_COLUMNS = 35
"""Columns of an action row: 31 joint targets, then vx_m_s, vy_m_s, yaw_rate_rad_s and pelvis_height_m."""

BASE_COLUMNS = slice(31, 35)
"""Columns of the base command."""

_ROW_JOINTS: NDArray[np.intp] = np.array([*range(15, 22), *range(29, 36), *range(22, 29), *range(36, 43), 12, 13, 14])


def standing_row(q_rad: NDArray[np.float64], pelvis_height_m: float) -> NDArray[np.float64]:
    """Returns the action row that keeps the joints `q_rad` and the base where they are."""
    row = np.zeros(ROW_COLUMNS)
    row[:31] = q_rad[_ROW_JOINTS]
    row[34] = pelvis_height_m
    return row
