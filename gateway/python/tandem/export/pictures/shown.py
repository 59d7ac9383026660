"""Columns of what cameras see, under way: films, or files within the table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...recording import Recording
from ..columns import View
from ..settings import ExportSettings
from ..statistics import Colours, Levels
from . import depth
from .encoding import ENCODINGS, Film, Pixels, png

DEPTH = "_depth"
"""What a camera's column of depth is called beside that of its colours, as LeRobot does."""


class Shown:
    """A camera's colours, or its depth."""

    def __init__(self, key: str, camera: str, folder: Path, settings: ExportSettings, *, is_depth: bool) -> None:
        """folder: Where the film comes to lie."""
        self.key = key
        self._camera, self._size, self._is_depth = camera, settings.size, is_depth
        self.counted: Levels = depth.Depths() if is_depth else Colours()
        self.files: list[bytes] | None = None
        self._film: Film | None = None
        if settings.images == "video":
            encoding = depth.ENCODING if is_depth else ENCODINGS[settings.codec]
            self._film = Film(folder / f"{key}.mp4", settings.size, settings.rate_hz, encoding)
        else:
            self.files = []

    def feature(self) -> dict[str, Any]:
        """As `meta/info.json` describes it, but for what only the film says."""
        width, height = self._size
        kind = "image" if self._film is None else "video"
        described: dict[str, Any] = {
            "dtype": kind,
            "shape": [height, width, self.counted.channels],
            "names": ["height", "width", "channels"],
        }
        if self._is_depth:
            described["info"] = depth.FEATURE if self._film is None else depth.FILM_FEATURE
        return described

    def add(self, recording: Recording, step: int, *, is_counted: bool) -> None:
        """Draws and writes the next picture."""
        pixels: Pixels
        if self._is_depth:
            depth_m = recording.picture(self._camera, step, size=self._size).depth_m
            pixels = depth.codes(depth_m)
            if self.files is not None:
                self.files.append(depth.tiff(depth_m))
        else:
            pixels = recording.colours(self._camera, step, size=self._size)
            if self.files is not None:
                self.files.append(png(pixels))
        if self._film is not None:
            self._film.add(pixels)
        if is_counted:
            self.counted.add(pixels)

    def finish(self) -> None:
        """Writes the film's end."""
        if self._film is not None:
            self._film.finish()


def shown(view: View, folder: Path, settings: ExportSettings) -> list[Shown]:
    """What an episode has of its cameras."""
    kinds = (False, True) if settings.depth else (False,)
    return [
        Shown(key + DEPTH * is_depth, camera, folder, settings, is_depth=is_depth)
        for key, camera in view.cameras.items()
        for is_depth in kinds
    ]


def counted(about: dict[str, Any], feature: dict[str, Any]) -> Levels:
    """What was counted of a column's pictures.

    about: As a part's file holds it.
    feature: The column, as `meta/info.json` describes it.
    """
    kind = depth.Depths if feature.get("info", {}).get("is_depth_map") else Colours
    return kind(about["pictures"], about["levels"])
