"""Convex decomposition of concave meshes, kept in the user's cache folder."""

from __future__ import annotations

import hashlib
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..files import Array

#: Largest concavity that CoACD leaves; its default, which SceneSmith uses, too.
THRESHOLD = 0.05
#: Largest number of pieces of V-HACD, and the number of voxels that it cuts.
MAX_PIECES = 32
RESOLUTION = 100_000


def decomposed(vertices: Array, faces: Array) -> list[tuple[Array, Array]]:
    """Returns convex pieces, each as vertices and triangles: by CoACD if it is installed, otherwise by V-HACD."""
    cut = by_coacd if find_spec("coacd") else by_vhacd
    points = np.ascontiguousarray(vertices, dtype=float)
    corners = np.ascontiguousarray(faces, dtype=np.int32)
    settings = repr((cut.__name__, THRESHOLD, MAX_PIECES, RESOLUTION))
    key = hashlib.sha256(settings.encode() + points.tobytes() + corners.tobytes())
    kept = cache_folder() / f"{key.hexdigest()}.npz"
    if not kept.is_file():
        pieces = cut(points, corners)
        arrays = {f"v{number}": v for number, (v, _) in enumerate(pieces)}
        arrays |= {f"f{number}": f for number, (_, f) in enumerate(pieces)}
        kept.parent.mkdir(parents=True, exist_ok=True)
        unfinished = kept.with_suffix(f".{os.getpid()}.npz")
        np.savez_compressed(unfinished, **arrays)
        unfinished.replace(kept)
    with np.load(kept) as arrays:
        return [(arrays[f"v{number}"], arrays[f"f{number}"]) for number in range(len(arrays.files) // 2)]


def by_coacd(points: Array, corners: Array) -> list[tuple[Array, Array]]:
    coacd: Any = import_module("coacd")
    coacd.set_log_level("error")
    return [(np.asarray(v), np.asarray(f)) for v, f in coacd.run_coacd(coacd.Mesh(points, corners), threshold=THRESHOLD)]


def by_vhacd(points: Array, corners: Array) -> list[tuple[Array, Array]]:
    trimesh: Any = import_module("trimesh")
    mesh = trimesh.Trimesh(points, corners, process=False)
    # One thread, so that the same mesh gives the same pieces.
    settings = {"maxConvexHulls": MAX_PIECES, "resolution": RESOLUTION, "asyncACD": False}
    pieces: Any = trimesh.decomposition.convex_decomposition(mesh, **settings)
    return [(piece["vertices"], piece["faces"].reshape(-1, 3)) for piece in pieces]


def cache_folder() -> Path:
    """Returns the folder of `tandem` in the user's cache folder of this operating system."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "tandem" / "convex"
