"""Layout of rows of observations and actions, which data sets and environments share.

Names, units and ranges come from the native module. A data set has its contract in `meta/tandem.json`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from . import _native
from .errors import TandemError
from .recording import Recording

STATE = "observation.state"
"""Feature of a data set with the robots' state."""

ACTION = "action"
"""Feature with the rows of actions."""

IMAGES = "observation.images."
"""First part of the names of features with images; a camera's name follows."""

EGOCENTRIC = "egocentric"
"""Name of a robot's own camera in rows of a single robot; in rows of all robots it has the robot's name."""

RATES_HZ = tuple(_native.row_rates_hz())
"""Rates of rows; the first is the control rate."""

DEFAULT_DATA_RATE_HZ = 10
"""Rate of data sets, and of LeRobot's environment, which evaluates policies trained on them."""

DEFAULT_SIZE_PX = (320, 240)
"""Width and height of images."""

ABOUT_FILE = "meta/tandem.json"
"""File of a data set that describes it."""


@dataclass(frozen=True)
class RowColumn:
    """A number of a row."""

    name: str
    """Name, for example "left_shoulder_pitch_joint_rad"; in rows of all robots after the robot's name."""

    unit: str
    """Unit, for example "rad"."""

    min: float
    """Minimum of the range to which actions are clamped, in the unit."""

    max: float
    """Maximum."""


@dataclass(frozen=True)
class RowContract:
    """Contents of a row: one moment of all robots, or of one."""

    version: int
    """Version of the layout."""

    rate_hz: int
    """Rows per second. Joint targets are reached by the next row, on a straight line."""

    state: tuple[RowColumn, ...]
    """Columns of the state."""

    action: tuple[RowColumn, ...]
    """Columns of the actions."""

    images: dict[str, tuple[int, int]]
    """Width and height of each image."""

    @staticmethod
    def from_native(layout: str, robots: Sequence[str] | None, rate_hz: int, images: dict[str, tuple[int, int]]) -> RowContract:
        """Creates a contract from the layout of one robot's rows.

        Args:
            layout: Layout as JSON.
            robots: Names of the robots, which begin the columns' names. None: rows of a single robot.
        """
        one: dict[str, Any] = json.loads(layout)
        prefixes = ("",) if robots is None else tuple(f"{robot}." for robot in robots)
        state, action = (
            tuple(_column(entry, prefix) for prefix in prefixes for entry in one[part]) for part in ("state", "action")
        )
        return RowContract(one["version"], rate_hz, state, action, images)

    @staticmethod
    def of_recording(
        recording: Recording, robots: Sequence[str] | None, rate_hz: int, images: dict[str, tuple[int, int]]
    ) -> RowContract:
        """Returns the contract for rows of a recording; arguments are those of `from_native`."""
        return RowContract.from_native(recording.row_layout, robots, rate_hz, images)

    @staticmethod
    def from_json(given: dict[str, Any]) -> RowContract:
        """Reads the output of `as_json`."""
        state, action = (tuple(_column(entry) for entry in given[part]) for part in ("state", "action"))
        images = {name: (size[0], size[1]) for name, size in given["images"].items()}
        return RowContract(given["version"], given["rate_hz"], state, action, images)

    def as_json(self) -> dict[str, Any]:
        """Returns the contract in the form for files."""
        return json.loads(json.dumps(asdict(self)))

    @property
    def features(self) -> dict[str, tuple[str, ...]]:
        """Names of the numbers of each feature, by LeRobot's keys; for an image, the names of its axes."""
        named = {STATE: _names(self.state), ACTION: _names(self.action)}
        named = {key: names for key, names in named.items() if names}
        return named | {IMAGES + name: ("height", "width", "channels") for name in self.images}

    def differences(self, environment: RowContract) -> list[str]:
        """Returns the differences between this contract of a data set and that of an environment, in words."""
        found: list[str] = []
        if self.rate_hz != environment.rate_hz:
            found.append(
                f"it has {self.rate_hz} rows per second, and the environment {environment.rate_hz}; set fps={self.rate_hz}"
            )
        for name, size in self.images.items():
            if name not in environment.images:
                have = ", ".join(environment.images) or "none"
                found.append(f"it has the image {name}, and the environment has {have}")
            elif size != environment.images[name]:
                sizes = [f"{width}x{height}" for width, height in (size, environment.images[name])]
                flags = f"observation_width={size[0]} and observation_height={size[1]}"
                found.append(f"its image {name} has {sizes[0]} pixels, and the environment's {sizes[1]}; set {flags}")
        found += [f"it has no image {name}" for name in environment.images if name not in self.images]
        for part, own, other in (
            ("state", self.state, environment.state),
            ("action", self.action, environment.action),
        ):
            if (difference := _column_difference(own, other)) is not None:
                found.append(f"the {part} differs: {difference}")
        return found


def read_contract(data_set: str | PathLike[str]) -> RowContract:
    """Reads the contract of a data set.

    Args:
        data_set: Folder from `tandem export lerobot`.
    """
    path = Path(data_set) / ABOUT_FILE
    try:
        about: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        given = "give the folder that tandem export lerobot wrote; if LeRobot's tools made a data set of it, give the original"
        raise TandemError(f"there is no {path}; {given}") from None
    if "contract" not in about:
        raise TandemError(f"{data_set} names no row contract, because an older Tandem wrote it; export it again")
    contract = RowContract.from_json(about["contract"])
    if contract.version != (version := _native.row_contract_version()):
        found = f"{data_set} has version {contract.version} of the row contract, and this Tandem has {version}"
        raise TandemError(f"{found}; export it again")
    return contract


def check_contract(data_set: str | PathLike[str], environment: RowContract) -> None:
    """Refuses a data set whose rows are not those of the environment, with the differences."""
    found = read_contract(data_set).differences(environment)
    if found:
        raise TandemError(f"{data_set} does not fit the environment: {'. '.join(found)}")


def _column(entry: dict[str, Any], prefix: str = "") -> RowColumn:
    return RowColumn(prefix + entry["name"], entry["unit"], entry["min"], entry["max"])


def _names(columns: Sequence[RowColumn]) -> tuple[str, ...]:
    return tuple(column.name for column in columns)


def _column_difference(own: Sequence[RowColumn], other: Sequence[RowColumn]) -> str | None:
    """Returns the first difference between the columns of a data set and an environment."""
    for index, (one, another) in enumerate(zip(own, other, strict=False)):
        if one.name != another.name:
            return f"number {index} is {one.name} in the data set and {another.name} in the environment"
        if one != another:
            ranges = [f"{column.min:g} to {column.max:g} {column.unit}" for column in (one, another)]
            return f"{one.name} is {ranges[0]} in the data set and {ranges[1]} in the environment"
    return None if len(own) == len(other) else f"{len(own)} numbers in the data set and {len(other)} in the environment"
