"""Files next to the written MJCF: meshes as OBJ, images as PNG."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np

Array = Any


def numbers(values: Any) -> str:
    """Returns numbers in the format of an attribute."""
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


def escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def obj_text(
    vertices: Array,
    faces: Array,
    uv: tuple[Array, Array] | None = None,
    normals: tuple[Array, Array] | None = None,
) -> str:
    """Returns triangles as OBJ, optionally with texture coordinates and normals.

    Each of the two is a pair of values and, for each triangle, the indices of its corners' values.
    """
    lines = [f"v {x:.8g} {y:.8g} {z:.8g}" for x, y, z in vertices.tolist()]
    lines += [f"vt {u:.6g} {v:.6g}" for u, v in uv[0].tolist()] if uv else []
    lines += [f"vn {x:.5g} {y:.5g} {z:.5g}" for x, y, z in normals[0].tolist()] if normals else []
    of_corners = [np.asarray(faces) + 1]
    of_corners += [np.asarray(each[1]) + 1 for each in (uv, normals) if each]
    between = "//" if normals and not uv else "/"
    corner = between.join(["{}"] * len(of_corners))
    row = f"f {corner} {corner} {corner}".format
    # The indices of a corner are next to one another.
    of_triangles: Any = np.stack(of_corners, axis=2)
    lines += [row(*indices) for indices in of_triangles.reshape(len(faces), -1).tolist()]
    return "\n".join(lines) + "\n"


def png_bytes(pixels: Array) -> bytes:
    """Returns a PNG image of shape (height, width, bytes), with 1 to 4 bytes per pixel."""
    height, width, channels = pixels.shape
    kinds = {1: 0, 2: 4, 3: 2, 4: 6}
    header = struct.pack(">IIBBBBB", width, height, 8, kinds[channels], 0, 0, 0)
    rows: Any = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1).astype(np.uint8)], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    data = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + data
