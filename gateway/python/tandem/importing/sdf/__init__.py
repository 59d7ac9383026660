"""Models in SDF, and scenes of them in Drake's directives, written as MJCF for MuJoCo's compiler."""

from __future__ import annotations
