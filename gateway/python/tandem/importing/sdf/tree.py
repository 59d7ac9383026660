"""Trees of bodies from models and welds."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..files import Array
from .directives import SCOPE, Scene, scoped
from .parts import WORLD, Joint, Link, Model
from .poses import identity, inverse, pose, rotation_about


@dataclass
class Body:
    """A link in its tree."""

    name: str
    link: Link
    #: Pose in the parent, with joints at their initial positions.
    parent_from_body: Array
    #: Joint with the parent; `None` if the body is rigidly attached, or if it is free.
    joint: Joint | None
    #: Initial position of the joint.
    position: float
    is_free: bool
    model: Model
    children: list[Body] = field(default_factory=list["Body"])


def trees(scene: Scene) -> list[Body]:
    """Returns the bodies that stand in the world, with all others below them.

    Raises:
        ValueError: If a link is attached twice.
    """
    attached = attachments(scene)
    bodies: dict[str, Body] = {}
    roots: list[Body] = []
    for name, model in scene.models.items():
        first = model.root()
        for link in model.links.values():
            key = scoped(name, link.name)
            called = name if link.name == first else f"{name}/{link.name}"
            _, parent_from_body, joint = attached.get(key, (WORLD, None, None))
            is_free = key not in attached
            if parent_from_body is None:
                parent_from_body = placed(scene, name, model) @ link.pose
            position = scene.positions.get(scoped(name, joint.name), 0.0) if joint else 0.0
            at: Array = parent_from_body @ (displaced(joint, position) if joint else identity())
            bodies[key] = Body(called.replace(SCOPE, "/"), link, at, joint, position, is_free, model)
    for key, body in bodies.items():
        parent = attached[key][0] if key in attached else WORLD
        (roots if parent == WORLD else bodies[parent].children).append(body)
    reached = sum(1 for root in roots for _ in below(root))
    if reached < len(bodies):
        raise ValueError("some links are attached in a circle; open it")
    return roots


def below(body: Body) -> list[Body]:
    return [body, *(each for child in body.children for each in below(child))]


def attachments(scene: Scene) -> dict[str, tuple[str, Array, Joint | None]]:
    """Returns the parent of each link that has one, its pose in it with the joint at 0, and the joint unless it is rigid."""
    found: dict[str, tuple[str, Array, Joint | None]] = {}

    def attach(child: str, parent: str, parent_from_child: Array, joint: Joint | None) -> None:
        if child in found:
            raise ValueError(f"{child} is attached to {found[child][0]} and to {parent}; a link has one parent")
        found[child] = (parent, parent_from_child, joint)

    for weld in scene.welds:
        at = weld.parent.link_from_frame @ weld.parent_from_child @ inverse(weld.child.link_from_frame)
        attach(weld.child.link, weld.parent.link, at, None)
    for name, model in scene.models.items():
        for joint in model.joints.values():
            child, moves = model.links[joint.child], None if joint.kind == "fixed" else joint
            if joint.parent == WORLD:
                attach(scoped(name, child.name), WORLD, placed(scene, name, model) @ child.pose, moves)
            else:
                parent = model.links[joint.parent]
                attach(scoped(name, child.name), scoped(name, parent.name), inverse(parent.pose) @ child.pose, moves)
        for link in model.links.values():
            if model.static and scoped(name, link.name) not in found:
                attach(scoped(name, link.name), WORLD, placed(scene, name, model) @ link.pose, None)
    return found


def placed(scene: Scene, name: str, model: Model) -> Array:
    """Returns the pose of a model in the world: that of a link as directives have it, or the file's."""
    for link in model.links.values():
        stated = scene.placed.get(scoped(name, link.name))
        if stated is not None:
            return stated @ inverse(link.pose)
    return model.pose


def displaced(joint: Joint, position: float) -> Array:
    """Returns the motion of the child, in its own frame, from a joint's position 0 to another."""
    if not joint.axes or position == 0.0:
        return identity()
    direction: Any = joint.axes[0].direction
    if joint.kind == "prismatic":
        return pose(position * direction / np.linalg.norm(direction))
    anchor = pose(joint.place_in_child[:3, 3])
    return anchor @ pose([0, 0, 0], rotation_about(direction, position)) @ inverse(anchor)
