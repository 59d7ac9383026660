"""A second of the source and of what was written, both in MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np

from .engine import mujoco
from .names import Names

SECONDS = 1.0


def played(model: Any) -> tuple[Any, Any]:
    """Where bodies are at the beginning and after a second in which nobody acts."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    begin = data.xpos.copy()
    while data.time < SECONDS:
        mujoco.mj_step(model, data)
    return begin, data.xpos.copy()


def compared(source: Any, written: Any, names: Names) -> dict[str, Any]:
    """How far (m) bodies have come in a second, and how far they then are from the source's."""
    written.opt.timestep = source.opt.timestep
    _, expected = played(source)
    begin, found = played(written)
    moved = [body for body in range(1, written.nbody) if written.body_weldid[body]]
    if not moved:
        return {"from_begin_m": 0.0, "from_source_m": 0.0}
    away = np.linalg.norm(found - expected, axis=1)
    farthest = max(moved, key=lambda body: away[body])
    come = max(float(np.linalg.norm(found[body] - begin[body])) for body in moved)
    return {"from_begin_m": come, "from_source_m": float(away[farthest]), "farthest": names.of("body", farthest)}
