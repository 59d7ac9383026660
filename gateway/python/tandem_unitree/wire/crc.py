"""The checksum of `LowCmd_` and `LowState_`.

CRC-32 with polynomial 0x04c11db7 and initial value 0xffffffff, not reflected and without a final inversion, over the
little-endian 32-bit words of the C structure except its last word, which holds the checksum. The most significant byte of
a word is first. Source: `utils/crc.py` of unitree_sdk2_python.
"""

from __future__ import annotations

import zlib

import numpy as np

_MIRRORED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
"""Each byte with its bits in the opposite order."""


def crc32(words: bytes) -> int:
    """Returns the checksum of `words`, whose length is a multiple of 4.

    `zlib.crc32` uses the same polynomial on mirrored bits, so the bytes are mirrored before it and the result after it.
    """
    swapped = np.frombuffer(words, "<u4").astype(">u4").tobytes()
    mirrored = zlib.crc32(swapped.translate(_MIRRORED)) ^ 0xFFFFFFFF
    return int.from_bytes(mirrored.to_bytes(4, "little").translate(_MIRRORED), "big")
