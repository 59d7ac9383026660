"""Conversion of recordings to a LeRobot data set: searching, rendering in parallel, and joining."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import shutil
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from .. import _native
from ..errors import TandemError
from ..recording import Recording
from ..rows import ABOUT_FILE
from .columns import is_successful
from .modality import MODALITY_FILE, modality
from .parts import Part, Stopped, make_parts, write_whole
from .settings import ExportSettings, library
from .v2 import write_v2
from .v3 import write_v3

RECORDING_FILE = "episode.mcap"
GOOD_FILE = "good"
PLAN_FILE = "plan.json"

_NO_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP)
"""Errors of file systems without locks."""

TRAINED = 50
VALIDATED = 10


@dataclass(frozen=True)
class Exported:
    """A data set."""

    folder: Path
    """Folder of the data set."""

    task: str
    """Id of the task."""

    episodes: int
    """Number of episodes."""

    rows: int
    """Number of rows of all episodes together."""


@dataclass(frozen=True)
class Source:
    """A recording that becomes part of a data set."""

    path: Path
    name: str
    task: str
    seed: int
    success: bool
    state_hash: str
    build: str
    spec: dict[str, Any]


def export_lerobot(
    runs: str | PathLike[str],
    out: str | PathLike[str],
    settings: ExportSettings | None = None,
    *,
    only_successful: bool = False,
    only_good: bool = False,
    jobs: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Exported]:
    """Writes the recordings in a folder as a data set, or as one data set per task in its own folder. An
    interrupted export is continued, and a data set appears once it is complete.

    Args:
        runs: A recording, or a folder to search for recordings; those in it are taken in the order of their names.
        out: Folder of the data set.
        settings: Settings of the data set.
        only_successful: Leaves out episodes that did not reach their last phase.
        only_good: Leaves out episodes without a file `good` in their folder.
        jobs: Number of recordings to convert in parallel. None: one per core.
        progress: Called with the number of finished recordings, and of all.
    """
    settings = settings or ExportSettings()
    for name in ("pyarrow", "av"):
        library(name)
    workers = jobs or _native.available_processors()
    root, target = Path(runs), Path(out)
    found = find(root)
    if only_good:
        found = [path for path in found if (path.parent / GOOD_FILE).exists()]
        if not found:
            raise TandemError(f"no recording in {root} is marked good, by a file {GOOD_FILE!r} beside it")
    with ThreadPoolExecutor(workers) as pool:
        sources = list(pool.map(_source, found, [root] * len(found)))
    if only_successful:
        sources = [source for source in sources if source.success]
        if not sources:
            raise TandemError(f"no episode in {root} reached its last phase; all would be left out")
    tasks = list(dict.fromkeys(source.task for source in sources))
    of_task = {task: [source for source in sources if source.task == task] for task in tasks}
    done = 0

    def tell(further: int) -> None:
        nonlocal done
        done += further
        if progress is not None:
            progress(done, len(sources))

    folders = {task: target if len(tasks) == 1 else target / task for task in tasks}
    return [_export(of_task[task], folders[task], settings, workers, tell) for task in tasks]


def find(root: Path) -> list[Path]:
    """Finds the recordings in a folder, sorted by name with numbers in numeric order."""
    if root.is_file():
        return [root]

    def order(path: Path) -> list[tuple[int, int, str]]:
        words = re.split(r"(\d+)", path.relative_to(root).as_posix())
        return [(0, int(word), "") if word.isdigit() else (1, 0, word) for word in words if word]

    found = sorted(_below(root), key=order)
    if not found:
        raise TandemError(f"no {RECORDING_FILE} in {root}; give a folder of recordings, as of tandem collect")
    return found


def _below(root: Path) -> list[Path]:
    """Lists every recording once. Links are followed, because a folder of links is a way to select recordings. No
    folder is entered twice.
    """
    found: dict[str, Path] = {}
    # Files under their own names precede links to them.
    for follows in (False, True):
        entered: set[str] = set()
        for folder, inner, files in os.walk(root, followlinks=follows):
            real = os.path.realpath(folder)
            if real in entered:
                inner.clear()
                continue
            entered.add(real)
            inner.sort()
            if RECORDING_FILE in files:
                path = Path(folder) / RECORDING_FILE
                found.setdefault(os.path.realpath(path), path)
    return list(found.values())


def _source(path: Path, root: Path) -> Source:
    recording = Recording(path)
    name = path.name if path == root else path.relative_to(root).as_posix()
    if len(recording) < 2:
        raise TandemError(f"{path} has no step; leave it out")
    success, last = is_successful(recording), recording.state_hashes[-1]
    spec = {key: value for key, value in recording.spec.items() if key != "seed"}
    return Source(path, name, recording.task, recording.seed, success, last, recording.build, spec)


def _export(
    sources: Sequence[Source], out: Path, settings: ExportSettings, workers: int, tell: Callable[[int], None]
) -> Exported:
    plan = {
        "row_contract": _native.row_contract_version(),
        "settings": settings.as_json(),
        "recordings": [{"recording": source.name, "state_hash": source.state_hash} for source in sources],
    }
    task = sources[0].task
    if (there := _there(out, plan)) is not None:
        tell(len(sources))
        return Exported(out, task, there["episodes"], there["rows"])
    out.parent.mkdir(parents=True, exist_ok=True)
    work = out.with_name(out.name + ".partial")
    work.mkdir(exist_ok=True)
    with _alone(work):
        _begin(work, plan)
        parts = _make_all(sources, work, settings, workers, tell)
        _check_alike(parts)
        whole = work / "whole"
        shutil.rmtree(whole, ignore_errors=True)
        whole.mkdir()
        a_recording = len(parts) // len(sources)
        write = write_v3 if settings.version == "v3" else write_v2
        write(whole, parts, splits(len(sources), a_recording), settings)
        (whole / MODALITY_FILE).write_text(json.dumps(modality(parts[0].features), indent=4), encoding="utf-8")
        rows = sum(part.length for part in parts)
        _write_about(whole, plan, sources, parts, splits(len(sources), a_recording))
        if out.exists():
            out.rmdir()
        whole.rename(out)
    shutil.rmtree(work)
    return Exported(out, task, len(parts), rows)


def splits(recordings: int, a_recording: int) -> dict[str, str]:
    """Returns the splits: the first 50 recordings for training, the next 10 for validation. Each recording has
    `a_recording` episodes in the data set.
    """
    ends = {"train": min(TRAINED, recordings), "val": min(TRAINED + VALIDATED, recordings), "rest": recordings}
    found: dict[str, str] = {}
    begin = 0
    for name, end in ends.items():
        if end > begin:
            found[name] = f"{begin * a_recording}:{end * a_recording}"
        begin = end
    return found


def _there(out: Path, plan: dict[str, Any]) -> dict[str, Any] | None:
    """Returns the description of an existing data set if it is the same one."""
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return None
    try:
        about: dict[str, Any] = json.loads((out / ABOUT_FILE).read_text(encoding="utf-8"))
        if about["plan"] == plan:
            return about
    except (OSError, ValueError, KeyError):
        pass
    raise TandemError(f"{out} is there and holds something else; give another folder, or remove it")


def _begin(work: Path, plan: dict[str, Any]) -> None:
    path = work / PLAN_FILE
    if not path.exists():
        write_whole(path, json.dumps(plan))
    elif json.loads(path.read_text(encoding="utf-8")) != plan:
        raise TandemError(f"{work} is what another export has left, of other recordings or settings; remove it")


@contextmanager
def _alone(work: Path) -> Generator[None, None, None]:
    with (work / "lock").open("w", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise TandemError(f"another export writes to {work} now; wait for it") from error
        except OSError as error:
            # Locking is impossible on a file system without locks.
            if error.errno not in _NO_LOCKS:
                raise
        yield


def _make_all(
    sources: Sequence[Source], work: Path, settings: ExportSettings, workers: int, tell: Callable[[int], None]
) -> list[Part]:
    stop = threading.Event()
    futures: list[Future[list[Part]]] = []
    with ThreadPoolExecutor(workers) as pool:

        def make(number: int, source: Source) -> list[Part]:
            parts = make_parts(source.path, source.name, work / "parts" / f"{number:06d}", settings, stop)
            tell(1)
            return parts

        try:
            futures = [pool.submit(make, number, source) for number, source in enumerate(sources)]
            ended, _ = wait(futures, return_when=FIRST_EXCEPTION)
            failed = [error for future in ended if (error := future.exception()) is not None]
            if failed:
                raise failed[0]
        finally:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
    return [part for future in futures for part in future.result()]


def _check_alike(parts: Sequence[Part]) -> None:
    first = parts[0]
    for part in parts:
        for key in first.features.keys() | part.features.keys():
            if first.features.get(key) != part.features.get(key):
                one, other = first.about["recording"], part.about["recording"]
                raise TandemError(f"{other} has another {key} than {one}; export them apart")
        if first.about["contract"] != part.about["contract"]:
            one, other = first.about["recording"], part.about["recording"]
            raise TandemError(f"{other} has other ranges of joints or base than {one}; export them apart")


def _write_about(
    whole: Path, plan: dict[str, Any], sources: Sequence[Source], parts: Sequence[Part], names: dict[str, str]
) -> None:
    """Writes the description of the data set, for readers and for the next export."""
    rows = sum(part.length for part in parts)
    builds = sorted({source.build for source in sources})
    recordings = [
        {"recording": source.name, "seed": source.seed, "success": source.success, "build": source.build} for source in sources
    ]
    specs: list[dict[str, Any]] = []
    for source in sources:
        if source.spec not in specs:
            specs.append(source.spec)
    told: list[dict[str, str]] = []
    for part in parts:
        if part.about["instructions"] not in told:
            told.append(part.about["instructions"])
    contract: dict[str, Any] = parts[0].about["contract"]
    about = {
        "task": sources[0].task,
        "contract": contract,
        "episodes": len(parts),
        "rows": rows,
        "successes": sum(source.success for source in sources),
        "builds": builds,
        "specs": specs,
        "instructions": told,
        "splits": names,
        "recordings": recordings,
        "plan": plan,
    }
    (whole / ABOUT_FILE).write_text(json.dumps(about, indent=2), encoding="utf-8")
    license = plan["settings"].get("license")
    card = CARD.format(
        license="" if license is None else f"license: {license}\n",
        task=sources[0].task,
        rows=rows,
        episodes=len(parts),
        recordings=len(sources),
        successes=about["successes"],
        seeds=", ".join(_ranges([source.seed for source in sources])),
        made="; ".join(_played(spec) for spec in specs),
        told="\n\n".join(" ".join(f"{robot}: {words}" for robot, words in words_of.items()) for words_of in told),
        builds=", ".join(builds),
        contract=f"version {contract['version']}, {contract['rate_hz']} rows per second",
        settings=", ".join(f"{name} {value}" for name, value in plan["settings"].items()),
        splits=", ".join(f"{name} {span}" for name, span in names.items()),
    )
    (whole / "README.md").write_text(card, encoding="utf-8")


def _played(spec: dict[str, Any]) -> str:
    """Describes how episodes were played. Disturbances are described in the last paragraph of the card."""
    variation = ", ".join(f"{name} {value:g}" for name, value in spec.get("variation", {}).items())
    camera = f", camera {spec['camera']}" if "camera" in spec else ""
    sensors = f"sensors {spec['sensing']['sensors']}{camera}"
    return f"{spec['protocol']} protocol, {sensors}" + (f", {variation}" if variation else "")


def _ranges(numbers: Sequence[int]) -> list[str]:
    ranges: list[list[int]] = []
    for number in sorted(set(numbers)):
        if ranges and ranges[-1][1] == number - 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return [str(first) if first == last else f"{first}-{last}" for first, last in ranges]


CARD = """---
{license}task_categories:
- robotics
tags:
- LeRobot
configs:
- config_name: default
  data_files: data/*/*.parquet
---

# {task}

{episodes} episodes, {rows} rows, of {recordings} recordings, {successes} of which reached the last phase: simulated Unitree
G1 robots with Dex3 hands, recorded and exported by Tandem (`tandem export lerobot`). `meta/tandem.json` names every recording.

* Robots were told: {told}
* Episodes: {made}
* Seeds: {seeds}
* Builds: {builds}
* Row contract: {contract}; `meta/tandem.json` has names, units and ranges of all numbers
* Settings: {settings}
* Episodes of each split: {splits}

A row is a moment: `observation` is what robots sensed and saw then, `action` the joint targets that are to be reached when
the next row begins, and the mean velocity of the base until then. Where episodes were disturbed, that is what the demonstrator
told; what was done is the same with slow noise. Columns named `privileged` are what no policy gets.
"""

__all__ = ["Exported", "Stopped", "export_lerobot", "find", "splits"]
