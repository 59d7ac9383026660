"""Depth as LeRobot stores it since 0.6: in 12 bits, whose steps are smaller where things are near."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..statistics import Levels
from .encoding import Encoding, still

NEAREST_M = 0.01
FARTHEST_M = 10.0
SHIFT_M = 3.5
CODES = 4096
"""LeRobot's own range and steps: of 1.2 mm near the camera and 4.4 mm at the far end. What is farther is told as that."""

LOG_NEAREST = math.log(NEAREST_M + SHIFT_M)
LOG_RANGE = math.log(FARTHEST_M + SHIFT_M) - LOG_NEAREST

ENCODING = Encoding(
    "libx265",
    {"preset": "superfast", "x265-params": "lossless=1:bframes=0:pools=none:frame-threads=1:log-level=error"},
    given="gray12le",
    pixels="gray12le",
)

FEATURE: dict[str, Any] = {"is_depth_map": True, "depth_unit": "mm"}
"""What `meta/info.json` says of depth beside what it says of pictures. The unit is that of statistics and of TIFF files."""

FILM_FEATURE: dict[str, Any] = FEATURE | {
    "video.depth_min": NEAREST_M,
    "video.depth_max": FARTHEST_M,
    "video.shift": SHIFT_M,
    "video.use_log": True,
}
"""By which readers find metres again."""


def codes(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Depth, height by width in metres, as films hold it."""
    share = (np.log(depth_m.clip(NEAREST_M, FARTHEST_M) + SHIFT_M) - LOG_NEAREST) / LOG_RANGE
    return np.rint(share * (CODES - 1)).astype(np.uint16)


def metres(codes: NDArray[Any]) -> NDArray[np.float64]:
    """The depth that codes stand for."""
    return np.exp(LOG_NEAREST + codes / (CODES - 1) * LOG_RANGE) - SHIFT_M


def tiff(depth_m: NDArray[np.float32]) -> bytes:
    """A TIFF file of whole millimetres in 16 bits, in the same range."""
    millimetres = np.rint(depth_m.clip(NEAREST_M, FARTHEST_M) * 1000).astype(np.uint16)
    return still(millimetres, "tiff", "gray16le", {"compression_algo": "deflate"})


class Depths(Levels):
    """How often each depth occurs."""

    channels = 1
    values = metres(np.arange(CODES)) * 1000
