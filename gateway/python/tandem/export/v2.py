"""Version 2.1 of LeRobot's format, with separate files for each episode."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .parts import Part
from .settings import ExportSettings, library
from .statistics import Statistics
from .v3 import FILES_A_CHUNK, NUMBERING, ROBOT_TYPE, described_film, films_of, numbered, part_statistics, whole_statistics

DATA_PATH = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
VIDEO_PATH = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"


def write_v2(out: Path, parts: Sequence[Part], splits: dict[str, str], settings: ExportSettings) -> None:
    """Writes the whole data set into a folder."""
    pq = library("pyarrow.parquet")
    tasks = list(dict.fromkeys(part.about["instruction"] for part in parts))
    features = dict(parts[0].features)
    films = films_of(features)
    episodes: list[dict[str, Any]] = []
    statistics: list[dict[str, Any]] = []
    first = 0
    for number, part in enumerate(parts):
        instruction = part.about["instruction"]
        table = numbered(part, number, first, tasks.index(instruction), settings.rate_hz)
        pq.write_table(table, _made(out, DATA_PATH, number))
        for key in films:
            path = _made(out, VIDEO_PATH, number, key)
            shutil.copyfile(part.film(key), path)
            if number == 0:
                features[key] = described_film(features[key], path, settings.rate_hz)
        about = {name: part.about[name] for name in ("recording", "seed", "robot", "success", "instructions")}
        episodes.append({"episode_index": number, "tasks": [instruction], "length": part.length, "tandem": about})
        statistics.append({"episode_index": number, "stats": part_statistics(part, table)})
        first += part.length
    features |= {key: {"dtype": kind, "shape": [1], "names": None} for key, kind in NUMBERING.items()}
    info = {
        "codebase_version": "v2.1",
        "robot_type": ROBOT_TYPE,
        "total_episodes": len(parts),
        "total_frames": first,
        "total_tasks": len(tasks),
        "total_videos": len(parts) * len(films),
        "total_chunks": (len(parts) - 1) // FILES_A_CHUNK + 1,
        "chunks_size": FILES_A_CHUNK,
        "fps": settings.rate_hz,
        "splits": splits,
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH if films else None,
        "features": features,
    }
    meta = out / "meta"
    meta.mkdir()
    _write_lines(meta / "tasks.jsonl", [{"task_index": number, "task": task} for number, task in enumerate(tasks)])
    _write_lines(meta / "episodes.jsonl", episodes)
    _write_lines(meta / "episodes_stats.jsonl", statistics)
    (meta / "stats.json").write_text(json.dumps(_for_gr00t(whole_statistics(out, parts, features)), indent=4), encoding="utf-8")
    (meta / "info.json").write_text(json.dumps(info, indent=4, ensure_ascii=False), encoding="utf-8")


def _for_gr00t(statistics: dict[str, Statistics]) -> dict[str, Statistics]:
    """Returns the statistics without counts. Isaac-GR00T, unlike LeRobot, reads those of a whole data set in this version
    of the format, and takes one number per column from each of them.
    """
    return {key: {name: found[name] for name in found if name != "count"} for key, found in statistics.items()}


def _made(out: Path, pattern: str, episode: int, key: str = "") -> Path:
    """Returns a file's path after creating its folder."""
    name = pattern.format(episode_chunk=episode // FILES_A_CHUNK, episode_index=episode, video_key=key)
    path = out / name
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _write_lines(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    path.write_text("".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows), encoding="utf-8")
