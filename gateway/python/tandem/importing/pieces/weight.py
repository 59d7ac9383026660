"""Mass, center of mass and inertia of shapes."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from ..files import Array


def hull(vertices: Array, faces: Array) -> Any:
    """Returns the convex hull as a mesh of trimesh."""
    trimesh: Any = import_module("trimesh")
    return trimesh.Trimesh(vertices, faces, process=False).convex_hull


def hull_m3(vertices: Array, faces: Array) -> float:
    """Returns the volume of the convex hull; 0 of a mesh that is flat."""
    spatial: Any = import_module("scipy.spatial")
    try:
        return float(hull(vertices, faces).volume)
    except spatial.QhullError:
        return 0.0


def closed(vertices: Array, faces: Array) -> Any:
    """Returns a mesh that encloses a volume as it is, and the hull of any other."""
    trimesh: Any = import_module("trimesh")
    # Corners at one place become one, so that the seams of texture coordinates are no edges.
    made = trimesh.Trimesh(vertices, faces)
    edges: Any = made.edges
    there, back = (np.sort(one * len(made.vertices) + other) for one, other in (edges.T, edges.T[::-1]))
    is_closed = np.array_equal(there, back)
    return made if is_closed and made.volume > 0 else made.convex_hull


def solid(kind: str, size: list[float]) -> Any:
    """Returns a shape of MJCF as a mesh of trimesh."""
    trimesh: Any = import_module("trimesh")
    match kind:
        case "box":
            return trimesh.creation.box(2 * np.array(size))
        case "sphere":
            return trimesh.creation.icosphere(radius=size[0])
        case "ellipsoid":
            made = trimesh.creation.icosphere()
            made.apply_scale(size)
            return made
        case "cylinder":
            return trimesh.creation.cylinder(size[0], 2 * size[1])
        case _:
            return trimesh.creation.capsule(2 * size[1], size[0])


def weighed(solids: list[Any]) -> tuple[float, Array, Array]:
    """Returns volume (m3), center (m), and inertia (m5, about the center) of solids of density 1 that do not overlap."""
    volumes = np.array([abs(float(each.volume)) for each in solids])
    total = float(volumes.sum())
    if total <= 0.0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    center: Any = sum(volume * each.center_mass for volume, each in zip(volumes, solids, strict=True)) / total
    inertia: Any = np.zeros((3, 3))
    for volume, each in zip(volumes, solids, strict=True):
        away: Any = each.center_mass - center
        inertia += np.sign(each.volume) * each.moment_inertia + volume * (away @ away * np.eye(3) - np.outer(away, away))
    return total, center, inertia
