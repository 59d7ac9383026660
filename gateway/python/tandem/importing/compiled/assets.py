"""Meshes, pictures and materials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..engine import mujoco
from ..files import Array, escaped, numbers, obj_text, png_bytes
from ..report import Report
from .collisions import MESH, UNSEEN, Collision, is_replaced, triangles
from .names import Names

#: Names of the roles of a material's textures.
ROLES = {
    int(role): role.name[len("mjTEXROLE_") :].lower()
    for role in mujoco.mjtTextureRole.__members__.values()
    if role not in (mujoco.mjtTextureRole.mjTEXROLE_USER, mujoco.mjtTextureRole.mjNTEXROLE)
}
RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
#: Letters of a cube's faces in the order in which MuJoCo stores them.
FACES = "RLUDFB"
#: MuJoCo's number for images whose values are sRGB.
SRGB = 2


def write_assets(model: Any, names: Names, out: Path, collisions: dict[int, Collision], report: Report) -> list[str]:
    written = [geom for geom in range(model.ngeom) if model.geom_type[geom] == MESH]
    written = [geom for geom in written if not is_replaced(model, collisions, geom) or model.geom_group[geom] < UNSEEN]
    used = sorted({int(model.geom_dataid[geom]) for geom in written})
    rows = [*meshes(model, used, out, report), *convex_pieces(collisions, out)]
    rows += [*textures(model, out, report), *materials(model, names)]
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
        vertices, corners = triangles(model, mesh)
        face, faces = model.mesh_faceadr[mesh], len(corners)
        uv: tuple[Array, Array] | None = None
        if model.mesh_texcoordadr[mesh] >= 0:
            begin = model.mesh_texcoordadr[mesh]
            values: Any = model.mesh_texcoord[begin : begin + model.mesh_texcoordnum[mesh]]
            # The first row of an image is at 0 in MuJoCo, and at 1 in OBJ files.
            uv = (values * [1, -1] + [0, 1], model.mesh_facetexcoord[face : face + faces])
        begin = model.mesh_normaladr[mesh]
        normals = (model.mesh_normal[begin : begin + model.mesh_normalnum[mesh]], model.mesh_facenormal[face : face + faces])
        file = f"{mesh_name(mesh)}.obj"
        text = obj_text(vertices, corners, uv, normals)
        (out / "meshes" / file).write_text(text, encoding="utf-8")
        rows.append(f'<mesh name="{mesh_name(mesh)}" file="{file}"/>')
        report.meshes += 1
        report.triangles += faces
    return rows


def piece_name(mesh: int, piece: int) -> str:
    return f"{mesh_name(mesh)}_{piece}"


def convex_pieces(collisions: dict[int, Collision], out: Path) -> list[str]:
    rows: list[str] = []
    if any(collision.pieces for collision in collisions.values()):
        (out / "meshes").mkdir(exist_ok=True)
    for mesh, collision in collisions.items():
        for number, (vertices, faces) in enumerate(collision.pieces):
            name = piece_name(mesh, number)
            (out / "meshes" / f"{name}.obj").write_text(obj_text(vertices, faces), encoding="utf-8")
            rows.append(f'<mesh name="{name}" file="{name}.obj"/>')
    return rows


def textures(model: Any, out: Path, report: Report) -> list[str]:
    """Writes the images of materials, and the sky."""
    used = {int(texture) for texture in model.mat_texid.flat if texture >= 0}
    skies = [number for number, kind in enumerate(model.tex_type) if kind == mujoco.mjtTexture.mjTEXTURE_SKYBOX]
    # MuJoCo draws the first one.
    written = sorted(used | set(skies[:1]))
    report.pictures = len(written)
    return [write_texture(model, texture, out) for texture in written]


def materials(model: Any, names: Names) -> list[str]:
    return [write_material(model, names, material) for material in range(model.nmat)]


def write_material(model: Any, names: Names, material: int) -> str:
    of_roles = {role: int(model.mat_texid[material, role]) for role in ROLES if model.mat_texid[material, role] >= 0}
    row = f'<material name="{escaped(names.of("material", material))}" rgba="{numbers(model.mat_rgba[material])}"'
    if of_roles:
        uniform = "true" if model.mat_texuniform[material] else "false"
        row += f' texrepeat="{numbers(model.mat_texrepeat[material])}" texuniform="{uniform}"'
    # Without a number, a layer emits its own light.
    of_number = () if "emissive" in map(ROLES.get, of_roles) and not model.mat_emission[material] else ("emission",)
    for name in (*of_number, "specular", "shininess", "reflectance"):
        row += f' {name}="{numbers(getattr(model, "mat_" + name)[material])}"'
    for name in ("metallic", "roughness"):
        value = float(getattr(model, "mat_" + name)[material])
        # Less than 0 states nothing.
        row += f' {name}="{value:.9g}"' if value >= 0 else ""
    if list(of_roles) == [RGB]:
        row += f' texture="texture_{of_roles.pop(RGB)}"'
    if not of_roles:
        return row + "/>"
    layers = "".join(f'<layer role="{ROLES[role]}" texture="texture_{texture}"/>' for role, texture in of_roles.items())
    return f"{row}>{layers}</material>"


def write_texture(model: Any, texture: int, out: Path) -> str:
    (out / "textures").mkdir(exist_ok=True)
    height, width, channels = (int(a[texture]) for a in (model.tex_height, model.tex_width, model.tex_nchannel))
    first = int(model.tex_adr[texture])
    pixels: Any = model.tex_data[first : first + height * width * channels].reshape(height, width, channels)
    kind = mujoco.mjtTexture(int(model.tex_type[texture])).name[len("mjTEXTURE_") :].lower()
    grid = ""
    if kind != "2d" and height == 6 * width:
        sides = np.split(pixels, 6)
        if any((side != sides[0]).any() for side in sides[1:]):
            grid = f' gridsize="6 1" gridlayout="{FACES}"'
        else:
            pixels = sides[0]
    (out / "textures" / f"texture_{texture}.png").write_bytes(png_bytes(pixels))
    alpha = f' nchannel="{channels}"' if channels != 3 else ""
    # The first versions of MuJoCo 3.3 know no sRGB.
    space = ' colorspace="sRGB"' if hasattr(model, "tex_colorspace") and model.tex_colorspace[texture] == SRGB else ""
    return f'<texture name="texture_{texture}" type="{kind}" file="texture_{texture}.png"{grid}{alpha}{space}/>'
