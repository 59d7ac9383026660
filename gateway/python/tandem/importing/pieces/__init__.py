"""Triangle meshes: reading of files with their materials, and convex decomposition."""

from __future__ import annotations
