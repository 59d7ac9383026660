"""Meshes, pictures and materials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .engine import mujoco
from .files import Array, escaped, numbers, write_obj, write_png
from .names import Names
from .report import Report

MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
#: Texture roles that give a material its colour.
COLOURS = (mujoco.mjtTextureRole.mjTEXROLE_RGB, mujoco.mjtTextureRole.mjTEXROLE_RGBA)


def write_assets(model: Any, names: Names, out: Path, report: Report) -> list[str]:
    used = sorted({int(mesh) for mesh, kind in zip(model.geom_dataid, model.geom_type, strict=True) if kind == MESH})
    rows = [*meshes(model, used, out, report), *materials(model, names, out, report)]
    if model.nhfield:
        report.drop("<hfield>", int(model.nhfield))
    return ["<asset>", *rows, "</asset>"] if rows else []


def mesh_name(mesh: int) -> str:
    return f"mesh_{mesh}"


def meshes(model: Any, used: list[int], out: Path, report: Report) -> list[str]:
    """Writes the meshes of geoms, in the frames that MuJoCo gives them."""
    rows: list[str] = []
    if used:
        (out / "meshes").mkdir(exist_ok=True)
    for mesh in used:
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        uv: tuple[Array, Array] | None = None
        if model.mesh_texcoordadr[mesh] >= 0:
            begin = model.mesh_texcoordadr[mesh]
            values: Any = model.mesh_texcoord[begin : begin + model.mesh_texcoordnum[mesh]]
            # The first row of an image is at 0 in MuJoCo, and at 1 in OBJ files.
            uv = (values * [1, -1] + [0, 1], model.mesh_facetexcoord[face : face + faces])
        begin = model.mesh_normaladr[mesh]
        normals = (model.mesh_normal[begin : begin + model.mesh_normalnum[mesh]], model.mesh_facenormal[face : face + faces])
        file = f"{mesh_name(mesh)}.obj"
        write_obj(
            out / "meshes" / file,
            model.mesh_vert[first : first + count],
            model.mesh_face[face : face + faces],
            uv,
            normals,
        )
        rows.append(f'<mesh name="{mesh_name(mesh)}" file="{file}"/>')
        report.meshes += 1
        report.triangles += int(faces)
    return rows


def materials(model: Any, names: Names, out: Path, report: Report) -> list[str]:
    """Writes the materials and the images that give them their colours."""
    rows: list[str] = []
    written: set[int] = set()
    for material in range(model.nmat):
        texture = next((int(model.mat_texid[material, role]) for role in COLOURS if model.mat_texid[material, role] >= 0), -1)
        picture = ""
        if texture >= 0:
            if texture not in written:
                rows.append(write_texture(model, texture, out, report))
                written.add(texture)
            repeat = numbers(model.mat_texrepeat[material])
            uniform = "true" if model.mat_texuniform[material] else "false"
            picture = f' texture="texture_{texture}" texrepeat="{repeat}" texuniform="{uniform}"'
        rgba = numbers(model.mat_rgba[material])
        shine = "".join(
            f' {name}="{numbers(getattr(model, "mat_" + name)[material])}"'
            for name in ("emission", "specular", "shininess", "reflectance")
        )
        rows.append(f'<material name="{escaped(names.of("material", material))}" rgba="{rgba}"{picture}{shine}/>')
    report.pictures = len(written)
    return rows


def write_texture(model: Any, texture: int, out: Path, report: Report) -> str:
    (out / "textures").mkdir(exist_ok=True)
    height, width, channels = (int(a[texture]) for a in (model.tex_height, model.tex_width, model.tex_nchannel))
    first = int(model.tex_adr[texture])
    pixels: Any = model.tex_data[first : first + height * width * channels].reshape(height, width, channels)
    kind = "2d" if model.tex_type[texture] == mujoco.mjtTexture.mjTEXTURE_2D else "cube"
    if kind == "cube" and height == 6 * width:
        sides = np.split(pixels, 6)
        if any((side != sides[0]).any() for side in sides[1:]):
            report.drop("images of a cube's other five sides")
        pixels = sides[0]
    write_png(out / "textures" / f"texture_{texture}.png", pixels)
    alpha = ' nchannel="4"' if channels == 4 else ""
    return f'<texture name="texture_{texture}" type="{kind}" file="texture_{texture}.png"{alpha}/>'
