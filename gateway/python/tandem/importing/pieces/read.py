"""Mesh files, read by trimesh: triangles with texture coordinates, normals and materials."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..files import Array

#: Formats in which y is up.
Y_UP = (".glb", ".gltf")
Z_UP_FROM_Y_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
#: Colour of surfaces whose file states none.
GREY = [0.7, 0.7, 0.7, 1.0]
#: Attributes of trimesh's glTF material, by the role of the image in MJCF.
IMAGES = {
    "rgb": "baseColorTexture",
    "orm": "metallicRoughnessTexture",
    "normal": "normalTexture",
    "occlusion": "occlusionTexture",
    "emissive": "emissiveTexture",
}
#: Bytes of a binary glTF file before its text: its header, and the text's length and type.
GLB_HEAD = struct.Struct("<4sIIII")


@dataclass
class Look:
    """A material. Its images are arrays of shape (height, width, channels), by their roles in MJCF."""

    rgba: list[float]
    metallic: float | None = None
    roughness: float | None = None
    images: dict[str, Array] = field(default_factory=dict[str, Array])


@dataclass
class Piece:
    """Triangles of one material, with z up."""

    vertices: Array
    faces: Array
    uv: Array | None
    normals: Array | None
    look: Look


def unread_images(file: Path) -> int:
    """Returns the number of a glTF file's images that are KTX2, which trimesh leaves out."""
    if file.suffix.lower() not in Y_UP:
        return 0
    data = file.read_bytes()
    if data.startswith(b"glTF"):
        length = GLB_HEAD.unpack_from(data)[3]
        data = data[GLB_HEAD.size : GLB_HEAD.size + length]
    images: list[dict[str, str]] = json.loads(data).get("images", [])
    return sum(image.get("mimeType") == "image/ktx2" or image.get("uri", "").endswith(".ktx2") for image in images)


@lru_cache(maxsize=256)
def read_pieces(file: Path) -> tuple[Piece, ...]:
    """Returns the pieces of a file, in the frame of its scene. Those of glTF files are turned so that z is up.

    Raises:
        ValueError: If there are no triangles.
    """
    trimesh: Any = import_module("trimesh")
    try:
        scene: Any = trimesh.load(str(file), force="scene")
        parts: list[Any] = [part for part in scene.dump() if len(getattr(part, "faces", ()))]
    except ImportError:
        raise
    except Exception as error:  # trimesh's readers raise errors of many types.
        raise ValueError(f"{file}: {type(error).__name__}: {error}") from error
    if not parts:
        raise ValueError(f"{file}: there are no triangles in it")
    turn: Any = Z_UP_FROM_Y_UP if file.suffix.lower() in Y_UP else np.eye(3)
    return tuple(piece(part, turn) for part in parts)


def piece(part: Any, turn: Array) -> Piece:
    uv = getattr(part.visual, "uv", None)
    normals = part.vertex_normals @ turn.T if "vertex_normals" in part._cache else None
    return Piece(np.asarray(part.vertices) @ turn.T, np.asarray(part.faces), uv, normals, look(part.visual))


def look(visual: Any) -> Look:
    material: Any = getattr(visual, "material", None)
    if material is None:
        colours: Any = np.asarray(visual.vertex_colors) if visual.defined else None
        return Look(GREY if colours is None else [*(colours.mean(axis=0) / 255.0)])
    if not hasattr(material, "baseColorFactor"):
        image: Any = getattr(material, "image", None)
        if image is None:
            return Look([float(value) / 255.0 for value in material.main_color])
        return Look([1.0, 1.0, 1.0, 1.0], images={"rgb": np.asarray(image.convert("RGB"))})
    return physical_look(material)


def physical_look(material: Any) -> Look:
    """Returns a material of glTF. Its factors of colour are linear, and shown values of sRGB.

    Without a metallic factor glTF means metal. Exporters that leave it out (trimesh's among them) do not mean it.
    """
    factor = np.ones(4) if material.baseColorFactor is None else np.asarray(material.baseColorFactor, dtype=float) / 255.0
    shown = encoded(factor)
    shown[3] = factor[3] if material.alphaMode == "BLEND" else 1.0
    images: dict[str, Array] = {}
    for role, name in IMAGES.items():
        image: Any = getattr(material, name)
        if image is not None:
            images[role] = np.array(image.convert("RGB"))
    if "orm" in images:
        # In glTF the first channel of this image means nothing.
        images["orm"][..., 0] = 255
    if "occlusion" in images:
        images["occlusion"] = np.repeat(images["occlusion"][..., :1], 3, axis=2)
    emitted: Any = np.zeros(3) if material.emissiveFactor is None else np.asarray(material.emissiveFactor, dtype=float)
    pixels = images.pop("emissive", np.full((1, 1, 3), 255))
    if emitted.any():
        images["emissive"] = np.rint(255 * encoded(decoded(pixels / 255.0) * emitted).clip(0, 1)).astype(np.uint8)
    see_through = material.alphaMode in ("BLEND", "MASK")
    if see_through and material.baseColorTexture is not None:
        pixels = np.array(material.baseColorTexture.convert("RGBA"))
        if material.alphaMode == "MASK":
            cutoff = 255 * (0.5 if material.alphaCutoff is None else material.alphaCutoff)
            pixels[..., 3] = np.where(pixels[..., 3] >= cutoff, 255, 0)
        images["rgb"] = pixels
    return Look([*map(float, shown)], material.metallicFactor, material.roughnessFactor, images)


def encoded(linear: Array) -> Array:
    """Returns the values of sRGB for linear light."""
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055), dtype=float)


def decoded(values: Array) -> Array:
    """Returns linear light for values of sRGB."""
    return np.asarray(np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4), dtype=float)
