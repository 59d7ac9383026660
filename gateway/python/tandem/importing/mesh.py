"""Import of a mesh file as an object, read by trimesh."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from .files import escaped, numbers, write_obj, write_png
from .report import Report

DENSITY_KG_M3 = 500.0
#: Share of its hull below which a mesh is reported.
HOLLOW_SHARE = 0.6


def import_mesh(source: Path, out: Path) -> Report:
    """Writes `object.xml`: one free body with its lowest point at z = 0. In a glTF file, y is up."""
    trimesh: Any = import_module("trimesh")

    scene: Any = trimesh.load(str(source), force="scene")
    pieces: list[Any] = [piece for piece in scene.dump() if len(getattr(piece, "faces", ()))]
    if not pieces:
        raise ValueError("there are no triangles in it")
    written = out / "object.xml"
    report = Report(str(source), str(written))
    turn: Any = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]) if source.suffix.lower() in (".glb", ".gltf") else np.eye(3)
    for piece in pieces:
        piece.vertices = piece.vertices @ turn.T
    low = np.min([piece.bounds[0] for piece in pieces], axis=0)
    high = np.max([piece.bounds[1] for piece in pieces], axis=0)
    foot = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    (out / "meshes").mkdir(exist_ok=True)
    assets: list[str] = []
    geoms: list[str] = []
    for number, piece in enumerate(pieces):
        piece.vertices = piece.vertices - foot
        write_piece(piece, number, out, assets, geoms, report)
    name = escaped(source.stem)
    body = f'<body name="{name}"><freejoint/>{"".join(geoms)}</body>'
    head = '<mujoco><compiler meshdir="meshes" texturedir="textures"/>'
    written.write_text(
        "\n".join([head, "<asset>", *assets, "</asset>", f"<worldbody>{body}</worldbody></mujoco>"]) + "\n", encoding="utf-8"
    )
    report.bodies.append({"name": source.stem, "mass_kg": mass_kg(pieces), "joints": ["free"]})
    return report


def mass_kg(pieces: list[Any]) -> float:
    return DENSITY_KG_M3 * sum(float(piece.convex_hull.volume) for piece in pieces)


def write_piece(piece: Any, number: int, out: Path, assets: list[str], geoms: list[str], report: Report) -> None:
    uv = getattr(piece.visual, "uv", None)
    faces = np.asarray(piece.faces)
    write_obj(out / "meshes" / f"piece_{number}.obj", piece.vertices, faces, None if uv is None else (uv, faces))
    material: Any = getattr(piece.visual, "material", None)
    picture: Any = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    factor: Any = getattr(material, "baseColorFactor", None)
    colour: Any = factor if factor is not None else getattr(material, "main_color", [180, 180, 180, 255])
    rgba = np.asarray(colour, dtype=float) / 255.0
    texture = ""
    if picture is not None:
        (out / "textures").mkdir(exist_ok=True)
        write_png(out / "textures" / f"piece_{number}.png", np.asarray(picture.convert("RGB")))
        assets.append(f'<texture name="piece_{number}" type="2d" file="piece_{number}.png"/>')
        texture = f' texture="piece_{number}"'
        rgba = np.ones(4) if factor is None else rgba
        report.pictures += 1
    assets.append(f'<material name="piece_{number}"{texture} rgba="{numbers(rgba)}"/>')
    assets.append(f'<mesh name="piece_{number}" file="piece_{number}.obj"/>')
    geoms.append(f'<geom type="mesh" mesh="piece_{number}" material="piece_{number}" density="{DENSITY_KG_M3:g}"/>')
    report.meshes += 1
    report.triangles += len(faces)
    share = abs(float(piece.volume)) / max(float(piece.convex_hull.volume), 1e-12)
    if share < HOLLOW_SHARE:
        report.drop(f"hollows of a mesh, which collides as its hull (it fills {100 * share:.0f} % of it)")
