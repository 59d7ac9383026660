"""Depth in the format of LeRobot 0.6 or later: 12 bits, with smaller steps at short distances."""

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
"""LeRobot's own range and steps: 1.2 mm near the camera and 4.4 mm at the far end. Greater distances are clamped."""

LOG_NEAREST = math.log(NEAREST_M + SHIFT_M)
LOG_RANGE = math.log(FARTHEST_M + SHIFT_M) - LOG_NEAREST

ENCODING = Encoding(
    "libx265",
    {"preset": "superfast", "x265-params": "lossless=1:bframes=0:pools=none:frame-threads=1:log-level=error"},
    given="gray12le",
    pixels="gray12le",
)

FEATURE: dict[str, Any] = {"is_depth_map": True, "depth_unit": "mm"}
"""Entries of depth in `meta/info.json`, in addition to those of images. The unit is that of statistics and of TIFF
files.
"""

FILM_FEATURE: dict[str, Any] = FEATURE | {
    "video.depth_min": NEAREST_M,
    "video.depth_max": FARTHEST_M,
    "video.shift": SHIFT_M,
    "video.use_log": True,
}
"""Parameters with which readers convert codes to metres."""


def codes(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Converts depth, height by width in metres, to the codes in videos."""
    share = (np.log(depth_m.clip(NEAREST_M, FARTHEST_M) + SHIFT_M) - LOG_NEAREST) / LOG_RANGE
    return np.rint(share * (CODES - 1)).astype(np.uint16)


def metres(codes: NDArray[Any]) -> NDArray[np.float64]:
    """Converts codes to depth in metres."""
    return np.exp(LOG_NEAREST + codes / (CODES - 1) * LOG_RANGE) - SHIFT_M


def tiff(depth_m: NDArray[np.float32]) -> bytes:
    """Returns a TIFF file of whole millimetres in 16 bits, in the same range."""
    millimetres = np.rint(depth_m.clip(NEAREST_M, FARTHEST_M) * 1000).astype(np.uint16)
    return still(millimetres, "tiff", "gray16le", {"compression_algo": "deflate"})


class Depths(Levels):
    """Histogram of depths."""

    channels = 1
    values = metres(np.arange(CODES)) * 1000
