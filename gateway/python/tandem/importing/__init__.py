"""Import of scenes, objects and robots from other programs as MJCF that Tandem reads.

    pip install "tandem-sim[import]"
    tandem import scene.xml imported

MuJoCo's own compiler reads MJCF and URDF. SDF models, Drake's directives and meshes, read by trimesh, are written as MJCF for
it. The result is written as plain MJCF: bodies, joints, shapes, meshes and images, with a report of the parts that were left
out. A mesh becomes one object.
"""

from __future__ import annotations

from .command_line import import_file

__all__ = ["import_file"]
