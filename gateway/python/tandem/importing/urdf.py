"""URDF as MuJoCo's compiler takes it: files are found, and what is drawn is kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .files import obj_text
from .pieces.read import read_pieces
from .report import Report
from .sdf.mjcf import joined
from .sdf.parts import Shape
from .sdf.poses import identity
from .uri import resolved

#: Formats of meshes that MuJoCo reads.
READ = (".obj", ".stl", ".msh")
#: Settings of MuJoCo, whose defaults for URDF drop folders of files and shapes that do not collide.
SETTINGS = {"strippath": "false", "discardvisual": "false", "fusestatic": "false"}


def urdf_source(source: Path, report: Report) -> tuple[str, dict[str, bytes]]:
    """Returns the text for MuJoCo, and files beside those on the disk.

    Raises:
        ValueError: If a mesh that collides cannot be read.
    """
    root: Any = ElementTree.fromstring(source.read_bytes())
    files: dict[str, bytes] = {}
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            for mesh in shape.iter("mesh"):
                try:
                    mesh.set("filename", readable(resolved(mesh.get("filename", ""), source), files))
                except (ValueError, ImportError) as error:
                    if shape.tag == "collision":
                        raise
                    report.drop(f"visual: {error}")
                    link.remove(shape)
    settings = root.find("mujoco/compiler")
    if settings is None:
        settings = ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler")
    for name, value in SETTINGS.items():
        settings.set(name, value)
    return ElementTree.tostring(root, encoding="unicode"), files


def readable(file: Path, files: dict[str, bytes]) -> str:
    """Returns the name of a mesh that MuJoCo reads: the file, or one that is made of it."""
    if file.suffix.lower() in READ:
        return str(file.resolve())
    name = f"{file.stem}_{len(files)}.obj"
    read_pieces(file)
    files[name] = obj_text(*joined(Shape(identity(), "mesh", file=file))).encode()
    return name
