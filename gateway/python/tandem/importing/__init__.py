"""Import of scenes, objects and robots from other programs as MJCF that Tandem reads.

    pip install "tandem-sim[import]"
    python -m tandem.importing scene.xml imported

MuJoCo's own compiler reads MJCF and URDF. The result is written as plain MJCF: bodies, joints, shapes, meshes and images, with
a report of the parts that were left out. OBJ, STL, PLY, GLB and glTF files, read by trimesh, become one object each.
"""

from __future__ import annotations

from .command_line import import_file

__all__ = ["import_file"]
