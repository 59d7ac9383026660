"""Files next to the written MJCF: meshes as OBJ, images as PNG."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

Array = Any


def numbers(values: Any) -> str:
    """Returns numbers in the format of an attribute."""
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


def escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def write_obj(path: Path, vertices: Array, faces: Array, uv: Array | None = None, uv_faces: Array | None = None) -> None:
    """Writes triangles, optionally with texture coordinates."""
    lines = [f"v {x:.8g} {y:.8g} {z:.8g}" for x, y, z in vertices]
    if uv is not None and uv_faces is not None:
        lines += [f"vt {u:.6g} {v:.6g}" for u, v in uv]
        corners = zip(faces + 1, uv_faces + 1, strict=True)
        lines += [f"f {a}/{ta} {b}/{tb} {c}/{tc}" for (a, b, c), (ta, tb, tc) in corners]
    else:
        lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_png(path: Path, pixels: Array) -> None:
    """Writes an image of shape (height, width, bytes), with 1 to 4 bytes per pixel."""
    height, width, channels = pixels.shape
    kinds = {1: 0, 2: 4, 3: 2, 4: 6}
    header = struct.pack(">IIBBBBB", width, height, 8, kinds[channels], 0, 0, 0)
    rows: Any = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1).astype(np.uint8)], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + data)
