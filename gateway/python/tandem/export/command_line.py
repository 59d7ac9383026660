"""`python -m tandem.export`, which `tandem export` starts."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from functools import partial
from typing import get_args

from ..base import Camera, Renderer
from ..errors import TandemError
from ..rows import DEFAULT_DATA_RATE_HZ, RATES_HZ
from .lerobot import export_lerobot
from .settings import ExportSettings, library

INTERRUPTED = 130
"""Exit status that shells report for a process that SIGINT has ended."""


def parser() -> argparse.ArgumentParser:
    """Returns the parser of the flags. They are those of `tandem export`, whose help explains them."""
    flags = argparse.ArgumentParser(
        prog="tandem export", description="Make data sets of recordings, and logs of conversations; see tandem export --help."
    )
    flags.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    formats = flags.add_subparsers(dest="kind", required=True)
    lerobot = formats.add_parser("lerobot", help="what LeRobot reads")
    lerobot.add_argument("runs", metavar="RUNS")
    lerobot.add_argument("out", metavar="OUT")
    lerobot.add_argument("--format", choices=("v3", "v2"), default="v3")
    lerobot.add_argument("--view", choices=("joint", "robot"), default="joint")
    lerobot.add_argument("--cameras", default="egocentric", metavar="CAMERAS")
    lerobot.add_argument("--images", choices=("video", "png"), default="video")
    lerobot.add_argument("--codec", choices=("h264", "av1"), default="h264")
    lerobot.add_argument("--depth", action="store_true")
    lerobot.add_argument("--size", default="320x240", metavar="WIDTHxHEIGHT")
    lerobot.add_argument("--rate", type=int, choices=RATES_HZ, default=DEFAULT_DATA_RATE_HZ)
    lerobot.add_argument("--renderer", choices=get_args(Renderer))
    lerobot.add_argument("--camera-model", choices=get_args(Camera))
    lerobot.add_argument("--license", metavar="NAME")
    lerobot.add_argument("--only-successful", action="store_true")
    lerobot.add_argument("--only-good", action="store_true")
    lerobot.add_argument("--jobs", type=int, metavar="N")
    inspect = formats.add_parser("inspect", help="logs that Inspect reads")
    inspect.add_argument("runs", metavar="RUNS")
    inspect.add_argument("out", metavar="OUT")
    return flags


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code."""
    given = parser().parse_args(arguments)
    try:
        if given.kind == "inspect":
            library("inspect_ai", "logs of Inspect are written by inspect-ai", "inspect")
            run = _write_logs
        else:
            settings = settings_of(given)
            for name in ("pyarrow", "av"):
                library(name)
            run = partial(_write_data_sets, settings=settings)
        if not given.check:
            run(given)
        return 0
    except TandemError as error:
        print(f"tandem export: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("tandem export: interrupted; the same command goes on", file=sys.stderr)
        return INTERRUPTED


def settings_of(given: argparse.Namespace) -> ExportSettings:
    """Creates the settings from the flags."""
    sides = given.size.split("x")
    if len(sides) != 2 or not all(side.isdigit() for side in sides):
        raise TandemError("no size; give width and height in pixels, for example 320x240")
    cameras = () if given.cameras == "none" else tuple(given.cameras.split(","))
    return ExportSettings(
        version=given.format,
        view=given.view,
        cameras=cameras,
        images=given.images,
        codec=given.codec,
        depth=given.depth,
        size=(int(sides[0]), int(sides[1])),
        rate_hz=given.rate,
        renderer=given.renderer,
        camera_model=given.camera_model,
        license=given.license,
    )


def _write_logs(given: argparse.Namespace) -> None:
    from .inspect_log import export_inspect

    for log in export_inspect(given.runs, given.out):
        print(f"{log.path}: {log.task}, {log.model}, {log.samples} episodes")


def _write_data_sets(given: argparse.Namespace, settings: ExportSettings) -> None:
    begin = time.monotonic()
    shown = sys.stderr.isatty()

    def progress(done: int, total: int) -> None:
        if shown:
            print(f"\r{done} of {total} recordings, {time.monotonic() - begin:.0f} s", end="", file=sys.stderr, flush=True)

    data_sets = export_lerobot(
        given.runs,
        given.out,
        settings,
        only_successful=given.only_successful,
        only_good=given.only_good,
        jobs=given.jobs,
        progress=progress,
    )
    if shown:
        print(file=sys.stderr)
    for data_set in data_sets:
        size = sum(file.stat().st_size for file in data_set.folder.rglob("*") if file.is_file())
        print(f"{data_set.folder}: {data_set.task}, {data_set.episodes} episodes, {data_set.rows} rows, {size / 1e6:.1f} MB")
