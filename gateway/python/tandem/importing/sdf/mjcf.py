"""MJCF from trees of links."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from ..files import Array, escaped, numbers, obj_text, png_bytes
from ..pieces.read import Look, Piece, read_pieces, unread_images
from ..pieces.weight import closed, solid, weighed
from .directives import Scene, scoped
from .parts import Axis, Joint, Link, Shape
from .poses import attributes
from .tree import Body, below, trees

#: Density of things whose mass nobody states.
DENSITY_KG_M3 = 500.0
#: Mass and inertia of moving links that have none, which MuJoCo does not take.
MIN_MASS_KG, MIN_INERTIA_KG_M2 = 1e-3, 1e-6
#: Group of shapes that collide and are not drawn.
UNSEEN = 3
#: Extent below which a mesh has no hull, in metres.
FLAT_M = 1e-6


class Source:
    """MJCF text of a scene, the files that it names, and notes on what was left out."""

    def __init__(self, scene: Scene) -> None:
        self.files: dict[str, bytes] = {}
        self.notes: Counter[str] = Counter()
        self._assets: list[str] = []
        self._meshes: dict[tuple[Any, ...], list[tuple[str, str]]] = {}
        roots = trees(scene)
        for model in scene.models.values():
            self.notes.update(model.left_out)
        bodies = [row for root in roots for row in self._body(root, fixed=not root.is_free and root.joint is None)]
        rows = ["<mujoco>", '<compiler angle="radian" balanceinertia="true"/>']
        rows += ["<asset>", *self._assets, "</asset>", "<worldbody>", *bodies, "</worldbody>"]
        rows += ["<contact>", *excludes(scene, roots), "</contact>", "</mujoco>"]
        self.text = "\n".join(rows)

    def _body(self, body: Body, fixed: bool) -> list[str]:
        link, rows = body.link, [f'<body name="{escaped(body.name)}" {attributes(body.parent_from_body)}>']
        if not fixed:
            rows.append(self._inertial(link, body.is_free or body.joint is not None))
        if body.is_free:
            rows.append(f'<freejoint name="{escaped(body.name)}"/>')
        if body.joint:
            rows += joint_rows(body, body.joint)
        for shape in link.visuals:
            rows += self._visual(shape)
        for shape in link.collisions:
            rows += self._collision(shape)
        for child in body.children:
            rows += self._body(child, fixed and child.joint is None)
        return [*rows, "</body>"]

    def _inertial(self, link: Link, moves: bool) -> str:
        """Returns the link's inertial. What its file does not state is that of its shapes."""
        mass, center, inertia = link.mass_kg, link.center_m, link.inertia_kg_m2
        if mass is None or (inertia is None and mass > 0.0):
            solids = [solid_of(shape) for shape in link.collisions or link.visuals if shape.kind != "plane"]
            volume, middle, second = weighed(solids)
            self.notes[f"{'inertia' if mass else 'mass and inertia'} of a link; those of its shapes are used"] += 1
            center = center if mass is not None else middle
            mass = DENSITY_KG_M3 * volume if mass is None else mass
            inertia = second * mass / volume if volume else None
        if mass <= MIN_MASS_KG and moves:
            self.notes[f"mass of a moving link below {1000 * MIN_MASS_KG:g} g, which it has now"] += 1
            mass, inertia = MIN_MASS_KG, None
        if mass <= 0.0:
            return ""
        matrix: Any = np.eye(3) * MIN_INERTIA_KG_M2 if inertia is None else inertia
        six = [matrix[0, 0], matrix[1, 1], matrix[2, 2], matrix[0, 1], matrix[0, 2], matrix[1, 2]]
        if np.linalg.eigvalsh(matrix)[0] <= 0.0:
            self.notes["inertia of a link that no body can have"] += 1
            six = [*np.maximum(six[:3], MIN_INERTIA_KG_M2), 0.0, 0.0, 0.0]
        return f'<inertial pos="{numbers(center)}" mass="{mass:.9g}" fullinertia="{numbers(six)}"/>'

    def _visual(self, shape: Shape) -> list[str]:
        drawn = f'{attributes(shape.pose)} contype="0" conaffinity="0" mass="0"'
        # Meshes have materials of their own.
        own = f'rgba="{numbers(shape.rgba)}"' if shape.rgba else ""
        if not shape.file:
            return [f'<geom type="{shape.kind}" size="{numbers(shape.size)}" {drawn} {own}/>']
        try:
            named = self._drawn_meshes(shape)
        except ValueError as error:
            self.notes[f"visual: {error}"] += 1
            return []
        return [f'<geom type="mesh" mesh="{mesh}" material="{material}" {drawn}/>' for mesh, material in named]

    def _drawn_meshes(self, shape: Shape) -> list[tuple[str, str]]:
        """Returns the names of the meshes of a file, and of their materials."""
        key = (shape.file, shape.scale)
        if shape.file and key not in self._meshes:
            self._meshes[key] = []
            if unread := unread_images(shape.file):
                self.notes["image of KTX2 in a glTF file; PNG and JPEG are read"] += unread
            for piece in read_pieces(shape.file):
                if len(piece.vertices) < 4:
                    self.notes["mesh of fewer than four corners"] += 1
                    continue
                name = self._mesh(piece.vertices, piece, shape)
                self._meshes[key].append((name, self._material(piece.look, f"{shape.file.stem}_{name}")))
        return self._meshes[key]

    def _mesh(self, vertices: Array, piece: Piece, shape: Shape) -> str:
        name = f"m{len(self._assets)}"
        scaled = vertices * shape.scale
        mirrored = np.prod(shape.scale) < 0
        faces = piece.faces[:, ::-1] if mirrored else piece.faces
        uv = None if piece.uv is None else (piece.uv, faces)
        normals = None if piece.normals is None else (unit(piece.normals / shape.scale), faces)
        self.files[f"{name}.obj"] = obj_text(scaled, faces, uv, normals).encode()
        self._assets.append(f'<mesh name="{name}" file="{name}.obj" inertia="shell"/>')
        return name

    def _material(self, look: Look, name: str) -> str:
        """Writes a material with its images, and returns its name."""
        name = escaped(name)
        row = f'<material name="{name}" rgba="{numbers(look.rgba)}"'
        for attribute, value in (("metallic", look.metallic), ("roughness", look.roughness)):
            row += f' {attribute}="{value:.9g}"' if value is not None else ""
        layers = ""
        for role, pixels in look.images.items():
            image = f"{name}_{role}"
            file = f"t{len(self.files)}.png"
            self.files[file] = png_bytes(pixels)
            channels = f' nchannel="{pixels.shape[2]}"' if pixels.shape[2] != 3 else ""
            self._assets.append(f'<texture name="{image}" type="2d" file="{file}"{channels}/>')
            layers += f'<layer role="{role}{"a" if pixels.shape[2] == 4 else ""}" texture="{image}"/>'
        self._assets.append(f"{row}>{layers}</material>")
        return name

    def _collision(self, shape: Shape) -> list[str]:
        friction = f' friction="{shape.friction:.9g} 0.005 0.0001"' if shape.friction is not None else ""
        row = f'<geom {attributes(shape.pose)} group="{UNSEEN}" mass="0"{friction}'
        if not shape.file:
            return [f'{row} type="{shape.kind}" size="{numbers(shape.size)}"/>']
        key = (shape.file, shape.scale, "collision", shape.piece)
        if key not in self._meshes:
            vertices, faces = joined(shape)
            if min(np.ptp(vertices, axis=0)) < FLAT_M:
                self.notes["collision mesh without a volume"] += 1
                self._meshes[key] = []
            else:
                one = Piece(vertices, faces, None, None, Look([1.0] * 4))
                unscaled = Shape(shape.pose, "mesh")
                self._meshes[key] = [(self._mesh(vertices, one, unscaled), "")]
        return [f'{row} type="mesh" mesh="{mesh}"/>' for mesh, _ in self._meshes[key]]


def solid_of(shape: Shape) -> Any:
    """Returns a shape, in its link, as a mesh of trimesh; of a mesh that is not closed, the hull."""
    made = closed(*joined(shape)) if shape.file else solid(shape.kind, shape.size)
    made.apply_transform(shape.pose)
    return made


def unit(vectors: Array) -> Array:
    lengths: Any = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def joined(shape: Shape) -> tuple[Array, Array]:
    """Returns the triangles of a mesh, scaled: those of all materials together."""
    pieces = read_pieces(shape.file) if shape.file else ()
    if shape.piece is not None:
        pieces = pieces[shape.piece : shape.piece + 1]
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces[:-1])])
    faces = np.concatenate([piece.faces + start for piece, start in zip(pieces, starts, strict=True)])
    mirrored = np.prod(shape.scale) < 0
    return np.concatenate([piece.vertices for piece in pieces]) * shape.scale, faces[:, ::-1] if mirrored else faces


def joint_rows(body: Body, joint: Joint) -> list[str]:
    prefix = body.name.rsplit("/", 1)[0] if "/" in body.name else body.name
    name = escaped(f"{prefix}/{joint.name}".replace("::", "/"))
    place = numbers(joint.place_in_child[:3, 3])
    if joint.kind == "ball":
        return [f'<joint name="{name}" type="ball" pos="{place}"/>']
    kind = "slide" if joint.kind == "prismatic" else "hinge"
    rows: list[str] = []
    for number, axis in enumerate(joint.axes):
        suffix = f"_{number + 1}" if number else ""
        ref = body.position if number == 0 else 0.0
        row = f'<joint name="{name}{suffix}" type="{kind}" pos="{place}" ref="{ref:.9g}"'
        rows.append(f"{row} {axis_attributes(axis, joint)}/>")
    return rows


def axis_attributes(axis: Axis, joint: Joint) -> str:
    row = f'axis="{numbers(axis.direction)}" damping="{axis.damping:.9g}" frictionloss="{axis.friction:.9g}"'
    if axis.stiffness:
        row += f' stiffness="{axis.stiffness:.9g}" springref="{axis.rest:.9g}"'
    if axis.range and joint.kind != "continuous" and axis.range[0] < axis.range[1]:
        row += f' limited="true" range="{numbers(axis.range)}"'
    return row


def excludes(scene: Scene, roots: list[Body]) -> list[str]:
    """Returns pairs that do not collide: those of the files, and, as in Drake, links that share a joint."""
    names = {id(body.link): body.name for root in roots for body in below(root)}
    pairs = {(body.name, child.name) for root in roots for body in below(root) for child in body.children}
    of_scene = {scoped(name, link.name): link for name, model in scene.models.items() for link in model.links.values()}
    stated = [*scene.apart]
    for name, model in scene.models.items():
        stated += [(scoped(name, one), scoped(name, other)) for one, other in model.apart]
    for one, other in stated:
        pair = tuple(names[id(of_scene[key])] for key in (one, other))
        if pair[::-1] not in pairs:
            pairs.add((pair[0], pair[1]))
    return [f'<exclude body1="{escaped(a)}" body2="{escaped(b)}"/>' for a, b in sorted(pairs)]
