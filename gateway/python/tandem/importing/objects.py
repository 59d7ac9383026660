"""Import of SDF, Drake's directives and mesh files, each by way of MJCF that MuJoCo compiles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .compiled.model import write_model
from .engine import mujoco
from .pieces.read import read_pieces
from .pieces.weight import weighed
from .report import Report
from .sdf.directives import Scene, read_scene
from .sdf.mjcf import DENSITY_KG_M3, Source, solid_of
from .sdf.parts import Link, Model, Shape
from .sdf.poses import identity, pose
from .sdf.read import read_models


def import_sdf(source: Path, out: Path, decompose: bool) -> Report:
    """Writes `scene.xml` for the models of an SDF file, where the file has them."""
    scene = Scene({model.name: model for model in read_models(source)})
    return import_source(Source(scene), source, out, "scene.xml", decompose)


def import_directives(source: Path, out: Path, decompose: bool) -> Report:
    """Writes `scene.xml` for the models that Drake's directives place."""
    return import_source(Source(read_scene(source)), source, out, "scene.xml", decompose)


def import_mesh(source: Path, out: Path, decompose: bool) -> Report:
    """Writes `object.xml`: one free body of 500 kg/m3 with its lowest point at z = 0. In a glTF file, y is up."""
    pieces = read_pieces(source)
    low = np.min([piece.vertices.min(axis=0) for piece in pieces], axis=0)
    high = np.max([piece.vertices.max(axis=0) for piece in pieces], axis=0)
    foot = pose([-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]])
    collisions = [Shape(foot, "mesh", file=source, piece=number) for number in range(len(pieces))]
    volume_m3, center_m, inertia = weighed([solid_of(shape) for shape in collisions])
    link = Link(source.stem, identity(), DENSITY_KG_M3 * volume_m3, center_m, DENSITY_KG_M3 * inertia)
    link.visuals, link.collisions = [Shape(foot, "mesh", file=source)], collisions
    scene = Scene({source.stem: Model(source.stem, identity(), False, {source.stem: link})})
    return import_source(Source(scene), source, out, "object.xml", decompose)


def import_source(made: Source, source: Path, out: Path, written: str, decompose: bool) -> Report:
    model = mujoco.MjModel.from_xml_string(made.text, made.files)
    report = Report(str(source), str(out / written))
    write_model(model, out / written, report, decompose)
    for what, times in made.notes.items():
        report.drop(what, times)
    return report
