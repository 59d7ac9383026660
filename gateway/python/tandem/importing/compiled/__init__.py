"""Models that MuJoCo has compiled, written as plain MJCF."""

from __future__ import annotations
