"""`meta/modality.json`, which tells Isaac-GR00T where states and actions have the parts of the body."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from ..rows import ACTION, EGOCENTRIC, IMAGES, STATE
from .columns import BASE_VELOCITIES, HANDS
from .settings import DEPTH, THIRD_PERSON

MODALITY_FILE = "meta/modality.json"

PART_OF_JOINT = {
    "hip": "leg",
    "knee": "leg",
    "ankle": "leg",
    "waist": "waist",
    "shoulder": "arm",
    "elbow": "arm",
    "wrist": "arm",
    "hand": "hand",
}

EYES = ("ego_view", "rs_view")
"""Names of a robot's own camera in GR00T's configurations of this robot: since N1.6, and in N1.5."""

INSTRUCTION = "human.task_description"


def modality(features: dict[str, Any]) -> dict[str, Any]:
    """Returns the content of the file for a data set with these columns, as in `meta/info.json`.

    Names are those of `unitree_g1_full_body_with_waist_height_nav_cmd`. In rows of several robots, they begin with the
    robot's name.
    """
    films = [key for key, feature in features.items() if feature["dtype"] == "video" and not key.endswith(DEPTH)]
    return {
        "state": _slices(features[STATE]["names"]),
        "action": _slices(features[ACTION]["names"]),
        "video": {name: {"original_key": key} for key in films for name in _cameras(key.removeprefix(IMAGES))},
        "annotation": {INSTRUCTION: {"original_key": "task_index"}},
    }


def _slices(names: list[str]) -> dict[str, dict[str, int]]:
    """Returns begin and end of each part in a row with these columns."""
    found: dict[str, dict[str, int]] = {}
    for part, columns in groupby(range(len(names)), lambda column: _part(names[column])):
        indices = list(columns)
        found[part] = {"start": indices[0], "end": indices[-1] + 1}
    return found


def _part(name: str) -> str:
    """Returns the part to which a column belongs."""
    robot, _, column = name.rpartition(".")
    # A dot in the name of a part would be a separator for GR00T N1.5.
    return f"{robot}_{_part_of_robot(column)}" if robot else _part_of_robot(column)


def _part_of_robot(column: str) -> str:
    if column in BASE_VELOCITIES:
        return "navigate_command"
    if column == "pelvis_height_m":
        return "base_height_command"
    first, second, *_ = column.split("_")
    return f"{first}_{PART_OF_JOINT[second]}" if first in HANDS else PART_OF_JOINT[first]


def _cameras(name: str) -> tuple[str, ...]:
    """Returns the names of a camera."""
    if name == EGOCENTRIC:
        return EYES
    return (name if name == THIRD_PERSON else f"{name}_{EYES[0]}",)
