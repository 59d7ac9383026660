"""Names of the elements of a compiled model. MuJoCo refers to elements by number, files by name."""

from __future__ import annotations

from typing import Any

from ..engine import mujoco

OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "camera": mujoco.mjtObj.mjOBJ_CAMERA,
    "mesh": mujoco.mjtObj.mjOBJ_MESH,
    "texture": mujoco.mjtObj.mjOBJ_TEXTURE,
    "material": mujoco.mjtObj.mjOBJ_MATERIAL,
}


class Names:
    """Name of each element by its kind and number: the file's own, or one made of both."""

    def __init__(self, model: Any) -> None:
        self._model = model

    def of(self, kind: str, number: int) -> str:
        own = mujoco.mj_id2name(self._model, OBJECTS[kind], int(number))
        return own or f"{kind}_{number}"

    def stated(self, kind: str, number: int) -> str | None:
        """Returns the name in the file; `None` without one."""
        return mujoco.mj_id2name(self._model, OBJECTS[kind], int(number)) or None
