"""Meshes that collide: their volumes and those of their hulls, and their convex pieces."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..engine import mujoco
from ..files import Array
from ..pieces.decompose import decomposed
from ..pieces.weight import hull_m3
from ..report import Report

MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
#: Share of its hull below which a mesh is called concave.
CONCAVE_SHARE = 0.9
#: First group of geoms that are not drawn.
UNSEEN = 3


@dataclass
class Collision:
    """A mesh that collides, and the convex pieces that collide in its place; none if it collides as its hull."""

    pieces: list[tuple[Array, Array]] = field(default_factory=list[tuple[Array, Array]])


def colliding_meshes(model: Any, decompose: bool, report: Report) -> dict[int, Collision]:
    """Returns the meshes of geoms that collide, by their numbers in the model, and reports their volumes."""
    collides = (model.geom_type == MESH) & ((model.geom_contype != 0) | (model.geom_conaffinity != 0))
    found: dict[int, Collision] = {}
    for mesh in sorted({int(number) for number in model.geom_dataid[collides]}):
        vertices, faces = triangles(model, mesh)
        volume_m3, of_hull_m3 = abs(enclosed(vertices, faces)), hull_m3(vertices, faces)
        is_concave = volume_m3 < CONCAVE_SHARE * of_hull_m3
        pieces = decomposed(vertices, faces) if decompose and is_concave else []
        found[mesh] = Collision(pieces)
        report.collide(mesh, volume_m3, of_hull_m3, len(pieces), is_concave)
    return found


def is_replaced(model: Any, collisions: dict[int, Collision], geom: int) -> bool:
    """Returns True if convex pieces collide in place of the geom."""
    collides = model.geom_contype[geom] or model.geom_conaffinity[geom]
    return bool(model.geom_type[geom] == MESH and collides and collisions[int(model.geom_dataid[geom])].pieces)


def triangles(model: Any, mesh: int) -> tuple[Array, Array]:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return model.mesh_vert[first : first + count], model.mesh_face[face : face + faces]


def enclosed(vertices: Array, faces: Array) -> float:
    """Returns the volume (m3) that triangles enclose: that of their tetrahedra with the origin, V = 1/6 sum a . (b x c)."""
    a, b, c = (np.asarray(vertices, dtype=float)[faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
