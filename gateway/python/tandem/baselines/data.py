"""A data set of `tandem export lerobot` as arrays for training."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import TandemError
from ..export.columns import POSE, PRIVILEGED
from ..export.settings import library
from ..rows import ABOUT_FILE, ACTION, IMAGES, STATE, read_contract

PELVES = f"{PRIVILEGED}pelvis_in_world"
OBJECTS = f"{PRIVILEGED}objects_in_world"

ACTIONS = 35
"""Number of columns of a robot's action."""

BASE = 4
"""Number of columns of the base command, which come last: base velocities, and the height of the pelvis."""

JOINTS = 43
"""Number of sensed joint angles of a robot."""

STATES = JOINTS + BASE + 1
"""Number of inputs from a robot's state: the state of a row (joint angles and the base command in force), and the time
since the start.
"""

CLOCK_S = 20.0
"""Unit of the clock in seconds, so that an episode lasts about one unit."""


@dataclass(frozen=True)
class Demonstrations:
    """Moments of a data set, one after another."""

    task: str
    robots: tuple[str, ...]
    objects: tuple[str, ...]
    rate_hz: int
    size: tuple[int, int]
    """Width and height of the images."""

    pictures: NDArray[np.uint8]
    """Images: moments by robots by height by width by 3."""

    states: NDArray[np.float32]
    """States: moments by robots by `STATES`."""

    chunks: NDArray[np.float32]
    """Actions from each moment on: moments by rows by robots by 35. The last row is repeated after the end."""

    told: NDArray[np.bool_]
    """True for rows that were commanded, moments by rows. Rows after the end are not learned. A policy that learned
    to hold still then would release what it puts down, and never draw its hands back.
    """

    objects_in_pelvis_m: NDArray[np.float32]
    """Moments by robots by objects by 3: the target of the second task, which policies do not get as input."""

    validated: NDArray[np.bool_]
    """True for moments of the data set's validation episodes."""

    def __len__(self) -> int:
        return len(self.states)


def read(data_set: Path, chunk_rows: int, every: int) -> Demonstrations:
    """Reads a data set of the joint view, version 3, with the robots' own images.

    Args:
        chunk_rows: Rows of actions for each moment.
        every: One row in `every` becomes a moment.
    """
    read_contract(data_set)
    info, about = _json(data_set / "meta/info.json"), _json(data_set / ABOUT_FILE)
    settings = about["plan"]["settings"]
    if (settings["version"], settings["view"]) != ("v3", "joint"):
        raise TandemError(f"{data_set} is of version {settings['version']}, view {settings['view']}; export v3, view joint")
    features: dict[str, Any] = info["features"]
    robots = tuple(dict.fromkeys(name.split(".")[0] for name in features[STATE]["names"]))
    keys = [IMAGES + robot for robot in robots]
    if missing := [key for key in keys if key not in features]:
        raise TandemError(f"{data_set} has no {missing[0]}; export it with --cameras egocentric")
    columns = _columns(data_set, (STATE, ACTION, PELVES, OBJECTS, "episode_index"))
    episodes = columns["episode_index"]
    number, left = _places(episodes)
    kept = np.flatnonzero(number % every == 0)
    actions: NDArray[np.float32] = np.reshape(columns[ACTION], (len(episodes), len(robots), ACTIONS))
    later = kept[:, None] + np.minimum(np.arange(chunk_rows), left[kept, None])
    objects = tuple(dict.fromkeys(name.rsplit(".", 1)[0] for name in features[OBJECTS]["names"]))
    return Demonstrations(
        task=about["task"],
        robots=robots,
        objects=objects,
        rate_hz=info["fps"],
        size=(settings["size"][0], settings["size"][1]),
        pictures=_pictures(data_set, features, keys, kept),
        states=_states(np.reshape(columns[STATE], (len(episodes), len(robots), -1)), number, info["fps"])[kept],
        chunks=actions[later],
        told=np.arange(chunk_rows) <= left[kept, None],
        objects_in_pelvis_m=_in_pelvis(columns, len(robots), len(objects))[kept],
        validated=_is_in(info["splits"].get("val", "0:0"), episodes[kept]),
    )


def task_of(data_set: Path) -> str:
    """Returns the task's id."""
    return _json(data_set / ABOUT_FILE)["task"]


def _json(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise TandemError(f"there is no {path}; give the folder that tandem export lerobot wrote") from None


def _tables(data_set: Path, names: tuple[str, ...]) -> Iterator[Any]:
    parquet = library("pyarrow.parquet")
    for path in sorted(data_set.glob("data/chunk-*/file-*.parquet")):
        yield parquet.read_table(path, columns=list(names))


def _columns(data_set: Path, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """Returns columns of all rows as arrays."""
    parts: dict[str, list[NDArray[Any]]] = {name: [] for name in names}
    for table in _tables(data_set, names):
        for name in names:
            column = table[name].combine_chunks()
            # Lists of a fixed length, or one number per row.
            flat = column.flatten() if column.type.num_fields else column
            values: NDArray[Any] = flat.to_numpy(zero_copy_only=False)
            parts[name].append(np.reshape(values, (len(column), -1)) if column.type.num_fields else values)
    return {name: np.concatenate(found) for name, found in parts.items()}


def _places(episodes: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns the index of each row in its episode, and the number of rows after it."""
    lengths = np.unique(episodes, return_counts=True)[1]
    number = np.concatenate([np.arange(length, dtype=np.int64) for length in lengths])
    return number, np.repeat(lengths, lengths) - 1 - number


def _states(rows: NDArray[np.float32], number: NDArray[np.int64], rate_hz: int) -> NDArray[np.float32]:
    """Returns the states of rows with the clock: rows by robots by `STATES`."""
    since = number.astype(np.float32) / np.float32(rate_hz * CLOCK_S)
    clock = np.broadcast_to(since[:, None, None], (*rows.shape[:2], 1))
    return np.concatenate([rows, clock], axis=-1, dtype=np.float32)


def _in_pelvis(columns: dict[str, NDArray[Any]], robots: int, objects: int) -> NDArray[np.float32]:
    """Returns the positions of objects in the pelvis frames, R^T (p - o): rows by robots by objects by 3."""
    rows = len(columns[STATE])
    pelves = np.reshape(columns[PELVES], (rows, robots, len(POSE))).astype(np.float64)
    places = np.reshape(columns[OBJECTS], (rows, objects, len(POSE)))[..., :3].astype(np.float64)
    w, axis = pelves[..., None, 3:4], pelves[..., None, 4:]
    offset = places[:, None] - pelves[..., None, :3]
    # Rotation by the inverse of the unit quaternion (w, v): p - 2 w (v x p) + 2 v x (v x p).
    once = np.cross(axis, offset)
    return (offset - 2 * w * once + 2 * np.cross(axis, once)).astype(np.float32)


def _is_in(span: str, episodes: NDArray[Any]) -> NDArray[np.bool_]:
    begin, end = map(int, span.split(":"))
    return (begin <= episodes) & (episodes < end)


def _pictures(data_set: Path, features: dict[str, Any], keys: list[str], kept: NDArray[Any]) -> NDArray[np.uint8]:
    """Returns the images of the kept rows: rows by cameras by height by width by 3."""
    height, width = features[keys[0]]["shape"][:2]
    found = np.empty((len(kept), len(keys), height, width, 3), np.uint8)
    place = {int(row): number for number, row in enumerate(kept)}
    for camera, key in enumerate(keys):
        frames = _films(data_set, key) if features[key]["dtype"] == "video" else _stills(data_set, key)
        rows = 0
        for rows, frame in enumerate(frames, start=1):
            if (number := place.get(rows - 1)) is not None:
                found[number, camera] = frame.to_ndarray(format="rgb24")
        if rows <= kept[-1]:
            raise TandemError(f"{data_set} has {rows} pictures of {key}, and more rows; export it anew")
    return found


def _films(data_set: Path, key: str) -> Iterator[Any]:
    """Yields the frames of all videos of a camera: one per row, in order."""
    av = library("av")
    for path in sorted(data_set.glob(f"videos/{key}/chunk-*/file-*.mp4")):
        with av.open(str(path)) as container:
            yield from container.decode(video=0)


def _stills(data_set: Path, key: str) -> Iterator[Any]:
    av = library("av")
    for table in _tables(data_set, (key,)):
        for picture in table[key].to_pylist():
            with av.open(BytesIO(picture["bytes"])) as container:
                yield next(container.decode(video=0))
