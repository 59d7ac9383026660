"""Reading of SDF models (versions 1.4 to 1.12), with Drake's extensions.

A pose is stated relative to another frame: of a link to its model, of a joint to its child, of all others to the link or
frame to which they are attached. Poses in a `Model` are those of all joints at 0.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..files import Array
from ..uri import resolved
from .parts import WORLD, Axis, Frame, Joint, Link, Model
from .poses import identity, inverse, pose, rotation_rpy
from .shapes import read_shape

MODEL_FRAME = "__model__"
#: Separates the names of a nested model and of its parts.
SCOPE = "::"
#: Number of axes of each kind of joint.
AXES = {"fixed": 0, "ball": 0, "revolute": 1, "continuous": 1, "prismatic": 1, "universal": 2}
#: Ends of ranges from which on a joint has no end.
ENDLESS = 1e9
#: End of a range that has only one, in radians or metres.
FAR = 1e3


def read_models(file: Path) -> list[Model]:
    """Returns the models of an SDF file, those of its worlds included.

    Raises:
        ValueError: If the file is no SDF, or if something in it cannot be resolved.
    """
    root = parsed(file)
    if root.tag != "sdf":
        raise ValueError(f"{file}: an SDF file is a <sdf>, not a <{root.tag}>")
    version = tuple(int(part) for part in root.get("version", "1.7").split("."))
    models = [Reader(file, version).model(part) for part in root if part.tag == "model"]
    for world in root.iter("world"):
        reader = Reader(file, version)
        models += [reader.model(part) if part.tag == "model" else reader.included(part) for part in world if part.tag in PARTS]
    if not models:
        raise ValueError(f"{file}: there is no <model> in it")
    return models


PARTS = ("model", "include")


def parsed(file: Path) -> Any:
    """Returns the root element, with tags without their namespaces. Drake's often lack a declaration."""
    text = file.read_text(encoding="utf-8")
    if "drake:" in text and "xmlns:drake" not in text:
        text = re.sub(r"<sdf\b", '<sdf xmlns:drake="drake.mit.edu"', text, count=1)
    try:
        root = ElementTree.fromstring(text.encode())
    except ElementTree.ParseError as error:
        raise ValueError(f"{file}: {error}") from error
    for element in root.iter():
        element.tag = element.tag.rsplit("}", 1)[-1]
    return root


def words(element: Any, tag: str, default: str = "") -> str:
    return (element.findtext(tag) or default).strip()


def number(element: Any, tag: str, default: float) -> float:
    return float(words(element, tag) or default)


@dataclass
class Reader:
    """Reader of the models of one file."""

    file: Path
    version: tuple[int, ...]
    _frames: dict[str, Any] = field(default_factory=dict[str, Any])
    _known: dict[str, Array] = field(default_factory=dict[str, Array])
    _open: set[str] = field(default_factory=set[str])

    def model(self, element: Any) -> Model:
        model = Model(element.get("name", "model"), identity(), words(element, "static") in ("true", "1"))
        inner = Reader(self.file, self.version)
        for part in element:
            if part.tag in ("link", "joint", "frame"):
                inner._frames[part.get("name", "")] = part
        for part in element:
            if part.tag in PARTS:
                inner._nest(model, part)
        for part in element:
            if part.tag == "link":
                model.links[part.get("name")] = inner._link(part, model)
        if not model.links:
            raise ValueError(f"{self.file}: model {model.name} has no <link>")
        for part in element:
            inner._further(part, model)
        model.pose = self._place(element) @ inner._moved(element, model)
        return model

    def included(self, element: Any) -> Model:
        source = resolved(words(element, "uri"), self.file)
        model = read_models(source)[0]
        model.name = words(element, "name", model.name)
        model.static = words(element, "static") in ("true", "1") or model.static
        if element.find("pose") is not None or words(element, "placement_frame"):
            frame = model.frames.get(words(element, "placement_frame"))
            offset = model.links[frame.link].pose @ frame.link_from_frame if frame else identity()
            model.pose = self._place(element) @ inverse(offset)
        return model

    def _moved(self, element: Any, model: Model) -> Array:
        """Returns the pose of the model in the frame that its pose places."""
        frame = element.get("placement_frame")
        return inverse(self._pose_of(frame)) if frame else identity()

    def _nest(self, model: Model, element: Any) -> None:
        """Adds the parts of a nested model, called by both names."""
        inner = self.model(element) if element.tag == "model" else self.included(element)

        def called(name: str) -> str:
            return name if name == WORLD else f"{inner.name}{SCOPE}{name}"

        self._known[inner.name] = inner.pose
        for link in inner.links.values():
            link.name, link.pose = called(link.name), inner.pose @ link.pose
            model.links[link.name] = link
            self._known[link.name] = link.pose
        for joint in inner.joints.values():
            joint.name, joint.parent, joint.child = (called(name) for name in (joint.name, joint.parent, joint.child))
            model.joints[joint.name] = joint
        for name, frame in inner.frames.items():
            model.frames[called(name)] = Frame(called(frame.link), frame.link_from_frame)
        model.apart += [(called(one), called(other)) for one, other in inner.apart]
        for what, times in inner.left_out.items():
            model.left_out[what] = model.left_out.get(what, 0) + times

    def _place(self, element: Any, default: str = MODEL_FRAME) -> Array:
        """Returns the pose that an element states, in the model."""
        stated = element.find("pose")
        if stated is None:
            return self._pose_of(default)
        frame = stated.get("relative_to") or stated.get("frame") or default
        return self._pose_of(frame) @ read_pose(stated, self.file)

    def _pose_of(self, name: str) -> Array:
        """Returns the pose of a link, a joint or a frame in the model."""
        if name in ("", MODEL_FRAME, WORLD):
            return identity()
        if name not in self._known:
            element = self._frames.get(name)
            if element is None:
                have = ", ".join([*self._frames, *self._known])
                raise ValueError(f"{self.file}: there is no frame {name}; have: {have}")
            of_joint = words(element, "child") if element.tag == "joint" else MODEL_FRAME
            default = element.get("attached_to") or of_joint
            if name in self._open:
                raise ValueError(f"{self.file}: the pose of {name} is relative to itself")
            self._open.add(name)
            self._known[name] = self._place(element, default)
        return self._known[name]

    def _link(self, element: Any, model: Model) -> Link:
        inertial = element.find("inertial")
        link = Link(element.get("name"), self._pose_of(element.get("name")), None, np.zeros(3), None)
        if inertial is not None:
            place = read_pose(inertial.find("pose"), self.file)
            link.mass_kg, link.center_m = number(inertial, "mass", 1.0), place[:3, 3]
            inertia = inertial.find("inertia")
            if inertia is not None:
                x, y, z = (number(inertia, name, 1.0) for name in ("ixx", "iyy", "izz"))
                xy, xz, yz = (number(inertia, name, 0.0) for name in ("ixy", "ixz", "iyz"))
                of_place = np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])
                link.inertia_kg_m2 = place[:3, :3] @ of_place @ place[:3, :3].T
        for part in element:
            if part.tag in ("visual", "collision"):
                place = inverse(link.pose) @ self._place(part, link.name)
                shape = read_shape(part, place, self.file)
                kept = link.visuals if part.tag == "visual" else link.collisions
                if shape:
                    kept.append(shape)
                elif part.find("geometry/empty") is None:
                    model.leave_out(f"{part.tag} of a kind that is not read")
            elif part.tag not in ("inertial", "pose", "gravity", "self_collide", "kinematic", "velocity_decay"):
                model.leave_out(f"<{part.tag}> of a link")
        return link

    def _further(self, element: Any, model: Model) -> None:
        """Reads an element of a model that is neither a link nor a model."""
        match element.tag:
            case "joint":
                joint = self._joint(element, model)
                model.joints[joint.name] = joint
            case "frame":
                name = element.get("name")
                link = self._attached(name, model)
                model.frames[name] = Frame(link, inverse(model.links[link].pose) @ self._pose_of(name))
            case "collision_filter_group":
                members = [(part.text or "").strip() for part in element.findall("member")]
                ignored = [(part.text or "").strip() for part in element.findall("ignored_collision_filter_group")]
                if element.get("name") in ignored:
                    model.apart += [(a, b) for at, a in enumerate(members) for b in members[at + 1 :]]
                if any(name != element.get("name") for name in ignored):
                    model.leave_out("<drake:collision_filter_group> that ignores another group")
            case "link" | "pose" | "static" | "model" | "include" | "self_collide" | "allow_auto_disable" | "enable_wind":
                pass
            case other:
                model.leave_out(f"<{other}> of a model")

    def _attached(self, name: str, model: Model) -> str:
        """Returns the link to which a frame is attached in the end: the model's first one by default."""
        seen: set[str] = set()
        while name not in model.links and name in self._frames and name not in seen:
            seen.add(name)
            element = self._frames[name]
            name = words(element, "child") if element.tag == "joint" else element.get("attached_to", "")
        return name if name in model.links else next(iter(model.links))

    def _joint(self, element: Any, model: Model) -> Joint:
        name, kind = element.get("name"), element.get("type")
        if kind not in AXES:
            model.leave_out(f"joint of type {kind}, which is rigid now")
        parent, child = (words(element, tag) for tag in ("parent", "child"))
        for link in (parent, child):
            if link != WORLD and link not in model.links:
                have = ", ".join(model.links)
                raise ValueError(f"{self.file}: joint {name} names a link {link}, which is not there; have: {have}")
        child_from_model = inverse(model.links[child].pose)
        joint = Joint(name, kind if kind in AXES else "fixed", parent, child, child_from_model @ self._pose_of(name))
        for tag in ("axis", "axis2")[: AXES.get(kind, 0)]:
            joint.axes.append(self._axis(element.find(tag), name, child_from_model))
        return joint

    def _axis(self, element: Any, joint: str, child_from_model: Array) -> Axis:
        """Reads an axis; without one, or without its direction, z."""
        of_joint = "" if self.version >= (1, 5) else MODEL_FRAME
        if element is None:
            return Axis((child_from_model @ self._pose_of(joint))[:3, 2])
        xyz = element.find("xyz")
        stated = [0.0, 0.0, 1.0] if xyz is None else [float(part) for part in (xyz.text or "0 0 1").split()]
        frame = of_joint if xyz is None else xyz.get("expressed_in") or of_joint
        if words(element, "use_parent_model_frame") in ("true", "1"):
            frame = MODEL_FRAME
        direction = (child_from_model @ self._pose_of(frame or joint))[:3, :3] @ np.array(stated)
        axis = Axis(direction)
        for part in element.findall("limit"):
            low, high = number(part, "lower", -np.inf), number(part, "upper", np.inf)
            if low > -ENDLESS or high < ENDLESS:
                axis.range = (max(low, -FAR), min(high, FAR))
        for part in element.findall("dynamics"):
            axis.damping, axis.friction = number(part, "damping", 0.0), number(part, "friction", 0.0)
            axis.stiffness, axis.rest = number(part, "spring_stiffness", 0.0), number(part, "spring_reference", 0.0)
        return axis


def read_pose(element: Any, file: Path) -> Array:
    """Reads x y z roll pitch yaw, or a quaternion x y z w behind the position."""
    if element is None or not (element.text or "").strip():
        return identity()
    values = [float(part) for part in element.text.split()]
    by_quaternion = element.get("rotation_format") == "quat_xyzw"
    if len(values) != (7 if by_quaternion else 6):
        raise ValueError(f"{file}: a pose has 6 numbers (7 with a quaternion), not {element.text.strip()!r}")
    if by_quaternion:
        x, y, z, w = np.array(values[3:]) / np.linalg.norm(values[3:])
        half = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        return pose(values[:3], np.eye(3) + 2 * w * half + 2 * half @ half)
    angles = np.radians(values[3:]) if element.get("degrees") == "true" else values[3:]
    return pose(values[:3], rotation_rpy(*angles))
