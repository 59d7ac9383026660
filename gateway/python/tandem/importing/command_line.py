"""The command line of `python -m tandem.importing`."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from .report import Report

MESHES = (".obj", ".stl", ".ply", ".glb", ".gltf", ".off")
MODELS = (".xml", ".mjcf", ".urdf")


def import_file(source: str | Path, out: str | Path) -> Report:
    """Writes `scene.xml` (`object.xml` for a mesh), its files and `report.json` into the folder `out`."""
    source, out = Path(source), Path(out)
    kind = source.suffix.lower()
    if kind in MODELS:
        from .model import import_model as read
    elif kind in MESHES:
        from .mesh import import_mesh as read
    else:
        known = ", ".join(MODELS + MESHES)
        raise ValueError(f"{source}: files of this kind are not imported; these are: {known}")
    if not source.is_file():
        raise ValueError(f"{source}: there is no such file")
    out.mkdir(parents=True, exist_ok=True)
    report = read(source, out)
    for licence in sorted(source.parent.glob("LICEN[CS]E*")):
        if licence.is_file():
            shutil.copy(licence, out / licence.name)
    report.write(out)
    return report


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tandem.importing", description=__doc__)
    parser.add_argument("files", nargs="+", metavar="FILE", help="MJCF, URDF, or a mesh (" + ", ".join(MESHES) + ")")
    parser.add_argument("out", metavar="OUT", help="the folder to write; of several files, each gets a folder in it")
    given = parser.parse_args(arguments)
    failed = 0
    for file in given.files:
        out = Path(given.out) if len(given.files) == 1 else Path(given.out) / Path(file).stem
        try:
            print(import_file(file, out).told())
        except ImportError as error:
            print(f'{error}; pip install "tandem-sim[import]"', file=sys.stderr)
            return 1
        except Exception as error:  # Errors of foreign compilers have no common type.
            print(f"{file}: {error}", file=sys.stderr)
            failed += 1
    return 1 if failed else 0
