"""Image columns that are being written: videos, or files in the table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...recording import Recording
from ..columns import View
from ..settings import DEPTH, ExportSettings
from ..statistics import Colours, Levels
from . import depth
from .encoding import ENCODINGS, Film, Pixels, png


class Shown:
    """Colours or depth of a camera."""

    def __init__(self, key: str, camera: str, folder: Path, settings: ExportSettings, *, is_depth: bool) -> None:
        """Creates the column, with its video in `folder`."""
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
        """The column in the form of `meta/info.json`, without the entries that only the video has."""
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
        """Renders and writes the next image."""
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
        """Completes the video."""
        if self._film is not None:
            self._film.finish()


def shown(view: View, folder: Path, settings: ExportSettings) -> list[Shown]:
    """Returns the image columns of an episode."""
    kinds = (False, True) if settings.depth else (False,)
    return [
        Shown(key + DEPTH * is_depth, camera, folder, settings, is_depth=is_depth)
        for key, camera in view.cameras.items()
        for is_depth in kinds
    ]


def counted(about: dict[str, Any], feature: dict[str, Any]) -> Levels:
    """Returns the histograms of a column's images.

    Args:
        about: Entry in a part's file.
        feature: The column in the form of `meta/info.json`.
    """
    kind = depth.Depths if feature.get("info", {}).get("is_depth_map") else Colours
    return kind(about["pictures"], about["levels"])
