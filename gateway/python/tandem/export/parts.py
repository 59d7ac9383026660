"""Episodes of a data set as separate files, which keep the work of an interrupted run."""

from __future__ import annotations

import json
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..recording import Recording
from .columns import Column, View, columns, contract_of, is_successful, moments, views
from .pictures.shown import counted, shown
from .settings import ExportSettings, library
from .statistics import Levels, sampled

ROWS_FILE = "rows.parquet"
PART_FILE = "part.json"


class Stopped(Exception):
    """The user has interrupted the export."""


@dataclass(frozen=True)
class Part:
    """A complete episode."""

    folder: Path
    about: dict[str, Any]

    @property
    def length(self) -> int:
        """Number of rows."""
        return self.about["length"]

    @property
    def features(self) -> dict[str, Any]:
        """Its columns in the form of `meta/info.json`."""
        return self.about["features"]

    @property
    def rows_file(self) -> Path:
        """File with its columns, except for the numbers of rows and episodes."""
        return self.folder / ROWS_FILE

    def film(self, key: str) -> Path:
        """Returns its video of a camera."""
        return self.folder / f"{key}.mp4"

    def counted(self, key: str) -> Levels:
        """Returns the histograms of a camera's images."""
        return counted(self.about["counted"][key], self.features[key])


def make_parts(path: Path, source: str, folder: Path, settings: ExportSettings, stop: threading.Event) -> list[Part]:
    """Returns the episodes that a recording becomes. Missing ones are rendered and written.

    Args:
        path: The recording.
        source: Name of the recording in the data set.
        folder: Folder of the parts of this recording.
    """
    recording: Recording | None = None
    names = part_names(folder)
    if names is None:
        recording = Recording(path, renderer=settings.renderer, camera=settings.camera_model)
        names = [view.name or "joint" for view in views(recording, settings)]
    parts: list[Part] = []
    for index, name in enumerate(names):
        own = folder / name
        if not (own / PART_FILE).exists():
            recording = recording or Recording(path, renderer=settings.renderer, camera=settings.camera_model)
            own.mkdir(parents=True, exist_ok=True)
            _make(recording, views(recording, settings)[index], source, own, settings, stop)
        parts.append(Part(own, json.loads((own / PART_FILE).read_text(encoding="utf-8"))))
    # Later runs get the number of episodes without reading the recording.
    write_whole(folder / "parts.json", json.dumps(names))
    return parts


def part_names(folder: Path) -> list[str] | None:
    """Returns the names of a recording's episodes if all of them exist."""
    path = folder / "parts.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def write_whole(path: Path, text: str) -> None:
    """Writes a file either completely or not at all."""
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)


def _make(recording: Recording, view: View, source: str, folder: Path, settings: ExportSettings, stop: threading.Event) -> None:
    rows = moments(recording, settings)
    contract = contract_of(recording, view, settings)
    held = columns(recording, view, contract, rows)
    features = {key: column.feature() for key, column in held.items()}
    seen = shown(view, folder, settings)
    features |= {column.key: column.feature() for column in seen}
    looked_at = sampled(len(rows))
    for number, step in enumerate(rows.tolist()):
        if stop.is_set():
            raise Stopped
        # All cameras of a moment are rendered one after another, because they share its shadows.
        for column in seen:
            column.add(recording, step, is_counted=number in looked_at)
    for column in seen:
        column.finish()
    files = {column.key: column.files for column in seen if column.files is not None}
    _write_rows(folder / ROWS_FILE, held, files)
    about = {
        "recording": source,
        "task": recording.task,
        "seed": recording.seed,
        "robot": view.name,
        "instruction": view.task,
        "instructions": dict(recording.instructions),
        "success": is_successful(recording),
        "state_hash": recording.state_hashes[-1],
        "build": recording.build,
        "length": len(rows),
        "features": features,
        "contract": contract.as_json(),
        "counted": {
            column.key: {"pictures": column.counted.pictures, "levels": column.counted.levels.tolist()} for column in seen
        },
    }
    write_whole(folder / PART_FILE, json.dumps(about))


def _write_rows(path: Path, held: dict[str, Column], files: dict[str, list[bytes]]) -> None:
    pa, pq = library("pyarrow"), library("pyarrow.parquet")
    arrays: dict[str, Any] = {}
    for key, column in held.items():
        flat = pa.array(np.ravel(column.values))
        # A single name means one number per row, which LeRobot stores as a scalar.
        listed = column.names is not None and len(column.names) > 1
        arrays[key] = pa.FixedSizeListArray.from_arrays(flat, len(column.names or ())) if listed else flat
    for key, pictures in files.items():
        arrays[key] = pa.array([{"bytes": picture, "path": None} for picture in pictures], picture_type())
    partial = path.with_name(path.name + ".partial")
    pq.write_table(pa.table(arrays), partial)
    partial.replace(path)


def picture_type() -> Any:
    """Returns the type of an image in Hugging Face's `datasets`."""
    pa = library("pyarrow")
    return pa.struct([("bytes", pa.binary()), ("path", pa.string())])
