"""Parts of a model, between SDF and MJCF."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..files import Array

#: Name of the frame that does not move.
WORLD = "world"


@dataclass
class Shape:
    """A visual or collision shape of a link."""

    pose: Array
    #: Type of an MJCF geom; `mesh` has a file.
    kind: str
    #: Sizes of the geom.
    size: list[float] = field(default_factory=list[float])
    file: Path | None = None
    #: Number of a piece of the file, if the shape is that piece alone.
    piece: int | None = None
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    rgba: list[float] | None = None
    friction: float | None = None


@dataclass
class Link:
    """A rigid body. Its pose is that in the model; the inertia is about the center of mass, in the link's axes."""

    name: str
    pose: Array
    mass_kg: float | None
    center_m: Array
    inertia_kg_m2: Array | None
    visuals: list[Shape] = field(default_factory=list[Shape])
    collisions: list[Shape] = field(default_factory=list[Shape])


@dataclass
class Axis:
    """Direction of motion in the child's axes."""

    direction: Array
    range: tuple[float, float] | None = None
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    rest: float = 0.0


@dataclass
class Joint:
    """A joint between two links, at a place in the child's frame. A rigid joint has the kind `fixed`."""

    name: str
    kind: str
    parent: str
    child: str
    place_in_child: Array
    axes: list[Axis] = field(default_factory=list[Axis])


@dataclass
class Frame:
    """A frame attached to a link, or to the world."""

    link: str
    link_from_frame: Array


@dataclass
class Model:
    """A model as its file has it."""

    name: str
    pose: Array
    static: bool
    links: dict[str, Link] = field(default_factory=dict[str, Link])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    frames: dict[str, Frame] = field(default_factory=dict[str, Frame])
    #: Pairs of links that do not collide.
    apart: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    #: Elements that are not read, with their number.
    left_out: dict[str, int] = field(default_factory=dict[str, int])

    def leave_out(self, what: str) -> None:
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def root(self) -> str:
        """Returns the name of the first link that is no joint's child; of links in a circle, the first."""
        children = {joint.child for joint in self.joints.values() if joint.parent != WORLD}
        return next((name for name in self.links if name not in children), next(iter(self.links)))
