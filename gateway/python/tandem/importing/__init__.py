"""Scenes, objects and robots of other programs as MJCF that Tandem reads.

    pip install "tandem-sim[import]"
    python -m tandem.importing scene.xml imported

MuJoCo's own compiler reads what it can, MJCF and URDF; what comes of it is written plainly: bodies, joints, shapes, meshes and
pictures, with a report of what was left out. Of OBJ, STL, PLY, GLB and glTF files, read by trimesh, an object is made.
"""

from __future__ import annotations

from .command_line import import_file

__all__ = ["import_file"]
