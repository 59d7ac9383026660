"""Settings of an export."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import Any, Literal, TypeAlias, get_args

from ..base import Camera, Renderer
from ..errors import TandemError
from ..rows import DEFAULT_DATA_RATE_HZ, DEFAULT_SIZE_PX, EGOCENTRIC, RATES_HZ

Version: TypeAlias = Literal["v3", "v2"]
View: TypeAlias = Literal["joint", "robot"]
Images: TypeAlias = Literal["video", "png"]
Codec: TypeAlias = Literal["h264", "av1"]

THIRD_PERSON = "third_person"

DEPTH = "_depth"
"""Suffix of a depth column's name, as in LeRobot."""

SIDES_PX = range(16, 3841)


@dataclass(frozen=True)
class ExportSettings:
    """Contents and format of a data set."""

    version: Version = "v3"
    """Version of LeRobot's format."""

    view: View = "joint"
    """View of a recording: "joint" is one episode with all robots' columns; "robot" is one per robot with its own
    columns.
    """

    cameras: tuple[str, ...] = (EGOCENTRIC,)
    """Cameras: "egocentric" for the head cameras of all robots, "third_person", or names of robots; empty for no
    images.
    """

    images: Images = "video"
    """Images as videos, or as PNG files in the tables."""

    codec: Codec = "h264"
    """Video codec: H.264, which is faster to write and read, or AV1, which LeRobot itself uses."""

    depth: bool = False
    """True to write depth beside the images of every camera, in the format of LeRobot 0.6 or later."""

    size: tuple[int, int] = DEFAULT_SIZE_PX
    """Width and height of images in pixels."""

    rate_hz: int = DEFAULT_DATA_RATE_HZ
    """Rows per second: 50, 25 or 10."""

    renderer: Renderer | None = None
    """Renderer of the images. None: that of each episode."""

    camera_model: Camera | None = None
    """Model of the head cameras. None: that of each episode."""

    license: str | None = None
    """Licence in the card, by the name that the Hugging Face Hub uses, for example "cc-by-4.0". None: none."""

    def __post_init__(self) -> None:
        for name, kind in (("version", Version), ("view", View), ("images", Images), ("codec", Codec)):
            if (value := getattr(self, name)) not in get_args(kind):
                raise TandemError(f"no {name} {value!r}; have: {', '.join(get_args(kind))}")
        if self.renderer is not None and self.renderer not in get_args(Renderer):
            raise TandemError(f"no renderer {self.renderer!r}; have: {', '.join(get_args(Renderer))}")
        if self.camera_model is not None and self.camera_model not in get_args(Camera):
            raise TandemError(f"no camera model {self.camera_model!r}; have: {', '.join(get_args(Camera))}")
        if self.license is not None and not re.fullmatch("[a-z0-9][a-z0-9.-]*", self.license):
            raise TandemError(f"no licence {self.license!r}; give a name of the Hugging Face Hub, for example cc-by-4.0")
        if self.rate_hz not in RATES_HZ:
            raise TandemError(f"no rate of {self.rate_hz} Hz; have: {', '.join(map(str, RATES_HZ))}")
        if len(self.size) != 2 or any(side not in SIDES_PX for side in self.size):
            raise TandemError(
                f"no size; give width and height in pixels, each {SIDES_PX[0]} to {SIDES_PX[-1]}, for example 320x240"
            )
        if self.images == "video" and any(side % 2 for side in self.size):
            raise TandemError("films have an even number of pixels each way; give such a size, or images as png")
        if self.depth and self.version == "v2":
            raise TandemError("LeRobot stores depth since version 3 of its format; give that, or no depth")
        if self.depth and not self.cameras:
            raise TandemError("depth is what cameras see; name cameras, or ask for no depth")

    @property
    def stride(self) -> int:
        """Number of control steps per row."""
        return RATES_HZ[0] // self.rate_hz

    def as_json(self) -> dict[str, Any]:
        """Returns the settings in the form for files."""
        settings = {**asdict(self), "cameras": list(self.cameras), "size": list(self.size)}
        # Exports without these have settings as they were before there was a choice, and can be continued.
        return {name: value for name, value in settings.items() if value is not None}

    def cameras_of(self, robots: Sequence[str]) -> tuple[str, ...]:
        """Returns the cameras for a recording with these robots, by their names in `Recording.picture`."""
        chosen: list[str] = []
        for name in self.cameras:
            if name not in (EGOCENTRIC, THIRD_PERSON, *robots):
                raise TandemError(f"no camera {name!r}; have: {', '.join((EGOCENTRIC, THIRD_PERSON, *robots))}")
            chosen.extend(robots if name == EGOCENTRIC else (name,))
        return tuple(dict.fromkeys(chosen))


def library(name: str, what: str = "data sets are written by pyarrow and PyAV", extra: str = "lerobot") -> Any:
    """Imports a library of an extra when it is needed; the rest of the package works without it.

    Args:
        what: Purpose of the library, for the error message.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise TandemError(f"{what}, and there is no {name}; pip install 'tandem-sim[{extra}]'") from error
