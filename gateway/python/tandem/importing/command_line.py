"""The command line of `tandem import`, which calls `python -m tandem.importing`."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

from .report import Report

MESHES = (".obj", ".stl", ".ply", ".glb", ".gltf", ".off")
MODELS = (".xml", ".mjcf", ".urdf")
SDF = ".sdf"
DIRECTIVES = (".yaml", ".yml")
USD = (".usd", ".usda", ".usdc", ".usdz")
NO_USD = (
    "no converter of USD scenes to MJCF works (usd2mjcf is empty, nvidia-srl-usd-to-urdf takes single robots); "
    "let the program that wrote the file export MJCF, URDF, SDF or glTF"
)
#: Modules of the extra `import`.
LIBRARIES = ("mujoco", "PIL", "scipy", "trimesh", "vhacdx", "yaml")
FILE_HELP = "MJCF, URDF, SDF, Drake's directives (.dmd.yaml), or a mesh (" + ", ".join(MESHES) + ")"
DECOMPOSE_HELP = "let concave meshes collide as convex pieces instead of as their hulls"


def import_file(source: str | Path, out: str | Path, decompose: bool = False) -> Report:
    """Writes `scene.xml` (`object.xml` for a mesh), its files and `report.json` into the folder `out`.

    Args:
        source: An MJCF, URDF or SDF file, Drake's directives, or a mesh.
        out: The folder, which is made.
        decompose: Lets concave meshes collide as convex pieces instead of as their hulls.

    Raises:
        ValueError: If the file cannot be read.
    """
    source, out = Path(source), Path(out)
    kind = source.suffix.lower()
    if kind in MODELS:
        from .compiled.model import import_model as read
    elif kind == SDF:
        from .objects import import_sdf as read
    elif kind in DIRECTIVES:
        from .objects import import_directives as read
    elif kind in MESHES:
        from .objects import import_mesh as read
    elif kind in USD:
        raise ValueError(f"{source}: {NO_USD}")
    else:
        known = ", ".join((*MODELS, SDF, *DIRECTIVES, *MESHES))
        raise ValueError(f"{source}: files of this kind are not imported; these are: {known}")
    if not source.is_file():
        raise ValueError(f"{source}: there is no such file")
    out.mkdir(parents=True, exist_ok=True)
    report = read(source, out, decompose)
    for licence in sorted(source.parent.glob("LICEN[CS]E*")):
        if licence.is_file():
            shutil.copy(licence, out / licence.name)
    report.write(out)
    return report


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="tandem import", description=__doc__)
    parser.add_argument("files", nargs="+", metavar="FILE", help=FILE_HELP)
    parser.add_argument("out", metavar="OUT", help="the folder to write; each of several files gets a folder in it")
    parser.add_argument("--decompose", action="store_true", help=DECOMPOSE_HELP)
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    try:
        prepare(given.files)
    except ValueError as error:
        print(f"tandem import: {error}", file=sys.stderr)
        return 1
    failed = 0
    files: list[str] = [] if given.check else given.files
    for file in files:
        out = Path(given.out) if len(given.files) == 1 else Path(given.out) / Path(file).stem
        try:
            print(import_file(file, out, given.decompose).told())
        except Exception as error:  # Errors of foreign compilers have no common type.
            text = str(error)
            print(text if text.startswith(file) else f"{file}: {text}", file=sys.stderr)
            failed += 1
    return 1 if failed else 0


def prepare(files: list[str]) -> None:
    """Checks that the libraries are installed, and that each file has a folder of its own.

    Raises:
        ValueError: If not.
    """
    missing = [name for name in LIBRARIES if find_spec(name) is None]
    if missing:
        raise ValueError(f'there is no {", ".join(missing)}; pip install "tandem-sim[import]"')
    twice = [name for name, times in Counter(Path(file).stem for file in files).items() if times > 1]
    if twice:
        raise ValueError(f"several files are called {', '.join(twice)}; import them one by one, each with its own folder")
