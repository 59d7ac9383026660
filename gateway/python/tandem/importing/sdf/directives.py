"""Drake's model directives (`*.dmd.yaml`): which models a scene has, where they are, and which of them are welded.

The format is that of Drake's documentation of `parsing::ModelDirective`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..files import Array
from ..uri import resolved
from .parts import WORLD, Frame, Model
from .poses import identity, pose, rotation_about, rotation_rpy
from .read import SCOPE, read_models


@dataclass
class Weld:
    """A rigid connection of two frames, which are a link and a pose in it."""

    parent: Frame
    child: Frame
    parent_from_child: Array


@dataclass
class Scene:
    """Models by their names, with the poses and positions that directives give them.

    Links and joints are called `MODEL::NAME` here.
    """

    models: dict[str, Model] = field(default_factory=dict[str, Model])
    frames: dict[str, Frame] = field(default_factory=dict[str, Frame])
    welds: list[Weld] = field(default_factory=list[Weld])
    #: Poses of links in the world.
    placed: dict[str, Array] = field(default_factory=dict[str, Array])
    #: Initial positions of joints, in radians or metres.
    positions: dict[str, float] = field(default_factory=dict[str, float])
    #: Pairs of links that do not collide.
    apart: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])

    def frame(self, name: str) -> Frame:
        """Returns the frame of this name: the world, one of `add_frame`, or `MODEL::LINK` or `MODEL::FRAME`."""
        if name == WORLD:
            return Frame(WORLD, identity())
        if name in self.frames:
            return self.frames[name]
        model_name, _, part = name.rpartition(SCOPE)
        while model_name not in self.models and SCOPE in model_name:
            model_name, _, further = model_name.rpartition(SCOPE)
            part = scoped(further, part)
        model = self.models.get(model_name)
        if model and part in model.links:
            return Frame(scoped(model_name, part), identity())
        if model and part in model.frames:
            frame = model.frames[part]
            return Frame(scoped(model_name, frame.link), frame.link_from_frame)
        have = ", ".join([WORLD, *self.frames, *(scoped(each, link) for each, of in self.models.items() for link in of.links)])
        raise ValueError(f"there is no frame {name}; have: {have}")


def scoped(model: str, name: str) -> str:
    return f"{model}{SCOPE}{name}"


class Tagged(dict[str, Any]):
    """A mapping with a tag, for example `!Rpy`."""

    tag: str = ""


def load(file: Path) -> Any:
    yaml: Any = import_module("yaml")

    class Loader(yaml.SafeLoader):  # type: ignore[misc]
        pass

    def tagged(loader: Any, suffix: str, node: Any) -> Tagged:
        made = Tagged(loader.construct_mapping(node, deep=True))
        made.tag = suffix
        return made

    Loader.add_multi_constructor("!", tagged)
    try:
        return yaml.load(file.read_text(encoding="utf-8"), Loader)
    except yaml.YAMLError as error:
        raise ValueError(f"{file}: {error}") from error


def as_mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{value!r} should be a mapping of names to values")
    return value  # type: ignore[return-value]


def read_scene(file: Path) -> Scene:
    """Reads a file of directives, and those that it names.

    Raises:
        ValueError: If a directive has errors or is not known.
    """
    scene = Scene()
    read_directives(file, "", scene)
    return scene


def read_directives(file: Path, namespace: str, scene: Scene) -> None:
    directives: list[Any] | None = as_mapping(load(file) or {}).get("directives")
    if not isinstance(directives, list):
        raise ValueError(f"{file}: a file of directives has a list `directives`")
    for number, directive in enumerate(directives, 1):
        try:
            [(kind, content)] = as_mapping(directive).items()
            read_directive(kind, content, file, namespace, scene)
        except (ValueError, KeyError, TypeError) as error:
            told = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
            raise ValueError(f"{file}, directive {number}: {told}") from error


def read_directive(kind: str, content: Any, file: Path, namespace: str, scene: Scene) -> None:
    def called(name: str) -> str:
        return scoped(namespace, name) if namespace and name != WORLD else name

    def frame(name: str) -> Frame:
        return scene.frame(name if name == WORLD or called(name) not in known(scene) else called(name))

    match kind:
        case "add_model":
            model = read_models(resolved(content["file"], file))[0]
            name = called(content["name"])
            scene.models[name] = model
            for joint, values in as_mapping(content.get("default_joint_positions") or {}).items():
                if len(values) == 1:
                    scene.positions[scoped(name, joint)] = float(values[0])
            for link, place in as_mapping(content.get("default_free_body_pose") or {}).items():
                scene.placed[scoped(name, link)] = in_world(scene, frame(place.get("base_frame", WORLD)), read_transform(place))
        case "add_frame":
            stated = content["X_PF"]
            base = frame(stated.get("base_frame", WORLD))
            name = called(content["name"])
            scene.frames[name] = Frame(base.link, base.link_from_frame @ read_transform(stated))
        case "add_weld":
            offset = read_transform(content.get("X_PC") or {})
            scene.welds.append(Weld(frame(content["parent"]), frame(content["child"]), offset))
        case "add_directives":
            within = called(content["model_namespace"]) if content.get("model_namespace") else namespace
            read_directives(resolved(content["file"], file), within, scene)
        case "add_model_instance":
            pass
        case "add_collision_filter_group":
            members = [frame(name).link for name in content.get("members", [])]
            if content["name"] in content.get("ignored_collision_filter_groups", []):
                scene.apart += [(a, b) for at, a in enumerate(members) for b in members[at + 1 :]]
        case other:
            raise ValueError(f"there is no directive {other}")


def known(scene: Scene) -> set[str]:
    links = {scoped(name, part) for name, model in scene.models.items() for part in [*model.links, *model.frames]}
    return links | set(scene.frames)


def in_world(scene: Scene, base: Frame, offset: Array) -> Array:
    if base.link == WORLD:
        return base.link_from_frame @ offset
    placed = scene.placed.get(base.link)
    if placed is None:
        raise ValueError(f"the pose is relative to {base.link}, whose own pose is not stated before")
    return placed @ base.link_from_frame @ offset


def read_transform(stated: Any) -> Array:
    """Reads translation and rotation, which are fixed numbers: `!Rpy` and `!AngleAxis` have degrees."""
    translation = stated.get("translation") or [0.0, 0.0, 0.0]
    rotation: Any = stated.get("rotation", {})
    if isinstance(translation, Tagged):
        raise ValueError(f"poses at random (!{translation.tag}) are not read; state numbers")
    by = str(getattr(rotation, "tag", "Rpy"))
    match by:
        case "Rpy":
            turned = rotation_rpy(*np.radians(rotation.get("deg", [0.0, 0.0, 0.0])))
        case "AngleAxis":
            turned = rotation_about(rotation["axis"], float(np.radians(rotation["angle_deg"])))
        case "Identity":
            turned = np.eye(3)
        case _:
            raise ValueError(f"rotations of kind !{by} are not read; use !Rpy or !AngleAxis")
    return pose([float(value) for value in translation], turned)
