"""Shapes of SDF links."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..files import Array
from ..uri import resolved
from .parts import Shape


def read_shape(element: Any, place: Array, file: Path) -> Shape | None:
    """Reads a visual or a collision; `None` for a kind that MJCF has not."""
    geometry = element.find("geometry")
    shape = None if geometry is None else read_geometry(geometry, place, file)
    if shape is None:
        return None
    diffuse = element.findtext("material/diffuse")
    if diffuse:
        colour = [float(part) for part in diffuse.split()]
        shape.rgba = [*colour, 1.0][:4]
    coefficients = [
        element.findtext(path)
        for path in ("surface/friction/ode/mu", "proximity_properties/mu_dynamic", "proximity_properties/mu_static")
    ]
    stated = [float(text) for text in coefficients if text]
    shape.friction = stated[0] if stated else None
    return shape


def read_geometry(geometry: Any, place: Array, file: Path) -> Shape | None:
    for kind in geometry:

        def values(tag: str, kind: Any = kind) -> list[float]:
            return [float(part) for part in (kind.findtext(tag) or "").split()]

        match kind.tag:
            case "mesh":
                scale = tuple(values("scale")) or (1.0, 1.0, 1.0)
                shape = Shape(place, "mesh", file=resolved(kind.findtext("uri") or "", file))
                shape.scale = (scale[0], scale[1], scale[2])
                return shape
            case "box":
                return Shape(place, "box", [length / 2 for length in values("size")])
            case "sphere":
                return Shape(place, "sphere", values("radius"))
            case "ellipsoid":
                return Shape(place, "ellipsoid", values("radii"))
            case "cylinder" | "capsule":
                return Shape(place, kind.tag, [*values("radius"), values("length")[0] / 2])
            case "plane":
                x, y, z = values("normal") or [0.0, 0.0, 1.0]
                if (x, y, z) != (0.0, 0.0, 1.0):
                    return None
                return Shape(place, "plane", [*[length / 2 for length in values("size")], 0.1])
            case _:
                pass
    return None
