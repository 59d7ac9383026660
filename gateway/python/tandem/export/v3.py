"""Version 3.0 of LeRobot's format, with many episodes per file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

import numpy as np

from .parts import Part
from .pictures.encoding import film_info, join_films
from .settings import ExportSettings, library
from .statistics import Statistics, of_numbers

MB = 1024**2
FILES_A_CHUNK = 1000
DATA_FILE_MB = 100
VIDEO_FILE_MB = 200

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

NUMBERING = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}

ROBOT_TYPE = "unitree_g1_dex3"


def write_v3(out: Path, parts: Sequence[Part], splits: dict[str, str], settings: ExportSettings) -> None:
    """Writes the whole data set into a folder."""
    tasks = list(dict.fromkeys(part.about["instruction"] for part in parts))
    episodes: list[dict[str, Any]] = []
    first = 0
    for number, part in enumerate(parts):
        about = part.about
        episodes.append(
            {
                "episode_index": number,
                "tasks": [about["instruction"]],
                "length": part.length,
                "dataset_from_index": first,
                "dataset_to_index": first + part.length,
            }
        )
        first += part.length
    features = dict(parts[0].features)
    _write_data(out, parts, tasks, episodes, settings)
    for key in films_of(features):
        path = _write_films(out, key, parts, episodes, settings)
        features[key] = described_film(features[key], path, settings.rate_hz)
    features |= {key: {"dtype": kind, "shape": [1], "names": None} for key, kind in NUMBERING.items()}
    for part, episode in zip(parts, episodes, strict=True):
        episode["meta/episodes/chunk_index"], episode["meta/episodes/file_index"] = 0, 0
        about = part.about
        for name in ("recording", "seed", "robot", "success"):
            episode[f"tandem/{name}"] = about[name]
        episode["tandem/instructions"] = json.dumps(about["instructions"])
    write_tasks(out / "meta/tasks.parquet", tasks)
    _write_episodes(out, episodes)
    info = {
        "codebase_version": "v3.0",
        "fps": settings.rate_hz,
        "features": features,
        "total_episodes": len(parts),
        "total_frames": first,
        "total_tasks": len(tasks),
        "chunks_size": FILES_A_CHUNK,
        "data_files_size_in_mb": DATA_FILE_MB,
        "video_files_size_in_mb": VIDEO_FILE_MB,
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH if films_of(features) else None,
        "robot_type": ROBOT_TYPE,
        "splits": splits,
    }
    (out / "meta/stats.json").write_text(json.dumps(whole_statistics(out, parts, features), indent=4), encoding="utf-8")
    (out / "meta/info.json").write_text(json.dumps(info, indent=4, ensure_ascii=False), encoding="utf-8")


def films_of(features: dict[str, Any]) -> list[str]:
    """Returns the columns that are videos."""
    return [key for key, feature in features.items() if feature["dtype"] == "video"]


def described_film(feature: dict[str, Any], path: Path, rate_hz: int) -> dict[str, Any]:
    """Returns a video column with the entries that only a video file has."""
    return feature | {"info": film_info(path, rate_hz) | feature.get("info", {})}


def place(files: int) -> dict[str, int]:
    """Returns chunk and index of the file that follows `files` others."""
    return {"chunk_index": files // FILES_A_CHUNK, "file_index": files % FILES_A_CHUNK}


def numbered(part: Part, number: int, first: int, task: int, rate_hz: int) -> Any:
    """Returns the rows of an episode, with the columns that number them.

    Args:
        number: Number of the episode.
        first: Number of rows before it.
        task: Number of its task.
    """
    pa, pq = library("pyarrow"), library("pyarrow.parquet")
    rows = pq.read_table(part.rows_file)
    frames = np.arange(part.length, dtype=np.int64)
    values = {
        "timestamp": (frames / rate_hz).astype(np.float32),
        "frame_index": frames,
        "episode_index": np.full(part.length, number, np.int64),
        "index": frames + first,
        "task_index": np.full(part.length, task, np.int64),
    }
    for key, column in values.items():
        rows = rows.append_column(key, pa.array(column))
    described = {key: _described(feature) for key, feature in part.features.items() if feature["dtype"] != "video"}
    described |= {key: {"dtype": kind, "_type": "Value"} for key, kind in NUMBERING.items()}
    order = [key for key in described if key in rows.column_names]
    return rows.select(order).replace_schema_metadata({"huggingface": json.dumps({"info": {"features": described}})})


def _described(feature: dict[str, Any]) -> dict[str, Any]:
    """Returns a column in the form of Hugging Face's `datasets`."""
    if feature["dtype"] == "image":
        return {"_type": "Image"}
    value = {"dtype": feature["dtype"], "_type": "Value"}
    (length,) = feature["shape"]
    # `datasets` since 4.0 calls it a list, and reads the older name, the only one that readers of version 2.1 know.
    return value if length == 1 else {"feature": value, "length": length, "_type": "Sequence"}


def _write_data(
    out: Path, parts: Sequence[Part], tasks: list[str], episodes: list[dict[str, Any]], settings: ExportSettings
) -> None:
    pq = library("pyarrow.parquet")
    writer: Any = None
    files, filled = 0, 0
    for number, (part, episode) in enumerate(zip(parts, episodes, strict=True)):
        task = tasks.index(part.about["instruction"])
        table = numbered(part, number, episode["dataset_from_index"], task, settings.rate_hz)
        if writer is not None and filled + table.nbytes > DATA_FILE_MB * MB:
            writer.close()
            writer, filled, files = None, 0, files + 1
        if writer is None:
            path = out / DATA_PATH.format(**place(files))
            path.parent.mkdir(parents=True, exist_ok=True)
            writer = pq.ParquetWriter(path, table.schema, compression="snappy", use_dictionary=True)
        writer.write_table(table)
        filled += table.nbytes
        episode.update({f"data/{name}": value for name, value in place(files).items()})
        episode.update(_flat(part_statistics(part, table)))
    if writer is not None:
        writer.close()


def _write_films(out: Path, key: str, parts: Sequence[Part], episodes: list[dict[str, Any]], settings: ExportSettings) -> Path:
    """Writes a camera's videos, and returns the first."""
    groups: list[list[int]] = [[]]
    filled = 0
    for number, part in enumerate(parts):
        size = part.film(key).stat().st_size
        if groups[-1] and filled + size > VIDEO_FILE_MB * MB:
            groups.append([])
            filled = 0
        groups[-1].append(number)
        filled += size
    for files, group in enumerate(groups):
        path = out / VIDEO_PATH.format(video_key=key, **place(files))
        path.parent.mkdir(parents=True, exist_ok=True)
        join_films(path, [(parts[number].film(key), parts[number].length) for number in group], settings.rate_hz)
        before = 0
        for number in group:
            length = parts[number].length
            episodes[number] |= {f"videos/{key}/{name}": value for name, value in place(files).items()}
            episodes[number][f"videos/{key}/from_timestamp"] = before / settings.rate_hz
            episodes[number][f"videos/{key}/to_timestamp"] = (before + length) / settings.rate_hz
            before += length
    return out / VIDEO_PATH.format(video_key=key, **place(0))


def part_statistics(part: Part, table: Any) -> dict[str, Statistics]:
    """Returns the statistics of an episode's columns."""
    found = {key: part.counted(key).statistics() for key in part.about["counted"]}
    return found | {key: of_numbers(numbers_of(table, key)) for key in table.column_names if key not in found}


def numbers_of(table: Any, key: str) -> Any:
    """Returns a column of a table as an array, rows by numbers."""
    column = table[key].combine_chunks()
    flat = column.flatten() if hasattr(column, "flatten") else column
    return flat.to_numpy(zero_copy_only=False).reshape(len(table), -1)


def _flat(statistics: dict[str, Statistics]) -> dict[str, Any]:
    return {f"stats/{key}/{name}": value for key, found in statistics.items() for name, value in found.items()}


def whole_statistics(out: Path, parts: Sequence[Part], features: dict[str, Any]) -> dict[str, Statistics]:
    """Returns the statistics of all rows of a data set whose rows are written."""
    pa, pq = library("pyarrow"), library("pyarrow.parquet")
    files = sorted(out.glob("data/*/*.parquet"))
    found: dict[str, Statistics] = {}
    for key, feature in features.items():
        if feature["dtype"] in ("video", "image"):
            found[key] = reduce(add, (part.counted(key) for part in parts)).statistics()
        else:
            table = pa.concat_tables([pq.read_table(file, columns=[key]) for file in files])
            found[key] = of_numbers(numbers_of(table, key))
    return found


def _write_episodes(out: Path, episodes: list[dict[str, Any]]) -> None:
    pa, pq = library("pyarrow"), library("pyarrow.parquet")
    path = out / EPISODES_PATH.format(**place(0))
    path.parent.mkdir(parents=True, exist_ok=True)
    numbers = [key for key in episodes[0] if not key.startswith(("stats/", "tandem/"))]
    rest = [key for key in episodes[0] if key not in numbers]
    table = pa.table({key: pa.array([episode[key] for episode in episodes]) for key in [*numbers, *rest]})
    pq.write_table(table, path, compression="snappy", use_dictionary=True)


def write_tasks(path: Path, tasks: list[str]) -> None:
    """Writes the tasks as pandas writes a table with the instructions as its index."""
    pa, pq = library("pyarrow"), library("pyarrow.parquet")
    path.parent.mkdir(parents=True, exist_ok=True)
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(tasks, pa.string())})

    def described(name: str, kind: str, numpy_type: str) -> dict[str, Any]:
        return {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy_type, "metadata": None}

    unnamed = {"name": None, "field_name": None, "pandas_type": "unicode", "numpy_type": "object"}
    pandas = {
        "index_columns": ["task"],
        "column_indexes": [{**unnamed, "metadata": {"encoding": "UTF-8"}}],
        "columns": [described("task_index", "int64", "int64"), described("task", "unicode", "object")],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": "2.2.0",
    }
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(pandas)}), path)
