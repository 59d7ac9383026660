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


def write_obj(
    path: Path,
    vertices: Array,
    faces: Array,
    uv: tuple[Array, Array] | None = None,
    normals: tuple[Array, Array] | None = None,
) -> None:
    """Writes triangles, optionally with texture coordinates and normals.

    Each of the two is a pair of values and, for each triangle, the indices of its corners' values.
    """
    lines = [f"v {x:.8g} {y:.8g} {z:.8g}" for x, y, z in vertices]
    lines += [f"vt {u:.6g} {v:.6g}" for u, v in uv[0]] if uv else []
    lines += [f"vn {x:.5g} {y:.5g} {z:.5g}" for x, y, z in normals[0]] if normals else []
    of_corners = [faces, uv[1] if uv else None, normals[1] if normals else None]
    while of_corners[-1] is None:
        of_corners.pop()
    for triangle in range(len(faces)):
        indices = [["", "", ""] if each is None else [str(corner + 1) for corner in each[triangle]] for each in of_corners]
        lines.append("f " + " ".join("/".join(corner) for corner in zip(*indices, strict=True)))
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
