"""Encoding of images."""

from __future__ import annotations

import os
from dataclasses import dataclass
from fractions import Fraction
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import TandemError
from ..settings import Codec, library

Pixels = NDArray[np.uint8] | NDArray[np.uint16]

KEY_FRAME_EVERY = 2
"""Key frame interval of LeRobot's videos; decoding two frames finds any image."""


@dataclass(frozen=True)
class Encoding:
    """Parameters of a video encoder. It uses one thread, because a thread for each recording keeps the cores busy.
    Frames are encoded in display order, so that videos can be joined.
    """

    encoder: str
    options: dict[str, str]
    given: str = "rgb24"
    """FFmpeg's pixel format of the input."""

    pixels: str = "yuv420p"
    """FFmpeg's pixel format of the video."""


ENCODINGS: dict[Codec, Encoding] = {
    "av1": Encoding("libsvtav1", {"crf": "30", "preset": "12", "svtav1-params": "lp=1"}),
    "h264": Encoding("libx264", {"crf": "23", "preset": "veryfast", "bf": "0", "threads": "1"}),
}


class Film:
    """A video that is being written. The file at `path` appears when it is complete."""

    def __init__(self, path: Path, size: tuple[int, int], rate_hz: int, encoding: Encoding) -> None:
        # The AV1 encoder would otherwise print its settings.
        os.environ.setdefault("SVT_LOG", "1")
        self._av = library("av")
        self._path, self._partial = path, path.with_suffix(".partial")
        options = {**encoding.options, "g": str(KEY_FRAME_EVERY)}
        self._time_base = Fraction(1, rate_hz)
        self._pictures = 0
        self._given = encoding.given
        self._container: Any = self._av.open(str(self._partial), "w", format="mp4")
        self._stream = self._container.add_stream(encoding.encoder, rate=rate_hz, options=options)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = encoding.pixels

    def add(self, pixels: Pixels) -> None:
        """Writes the next image."""
        frame = self._av.VideoFrame.from_ndarray(pixels, format=self._given)
        frame.pts, frame.time_base = self._pictures, self._time_base
        self._pictures += 1
        self._container.mux(self._stream.encode(frame))

    def finish(self) -> None:
        """Completes the video and moves it to its path."""
        self._container.mux(self._stream.encode(None))
        self._container.close()
        self._partial.replace(self._path)


def join_films(path: Path, parts: list[tuple[Path, int]], rate_hz: int) -> None:
    """Joins videos, each given with its number of images, without encoding them again."""
    av = library("av")
    before = 0
    with av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"}) as film:
        stream: Any = None
        for part, pictures in parts:
            with av.open(str(part)) as given:
                source = given.streams.video[0]
                if stream is None:
                    stream = film.add_stream_from_template(source, opaque=True)
                    stream.time_base = source.time_base
                shift = round(Fraction(before, rate_hz) / source.time_base)
                count = 0
                for packet in given.demux(source):
                    if packet.dts is None:
                        continue
                    packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                    packet.stream = stream
                    film.mux(packet)
                    count += 1
                if count != pictures:
                    raise TandemError(f"{part} has {count} pictures and not {pictures}; remove its folder")
            before += pictures


def film_info(path: Path, rate_hz: int) -> dict[str, Any]:
    """Returns the description of a video for `meta/info.json`."""
    av = library("av")
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        return {
            "video.height": stream.height,
            "video.width": stream.width,
            "video.codec": stream.codec.canonical_name,
            "video.pix_fmt": stream.pix_fmt,
            "video.fps": rate_hz,
            "video.channels": len(stream.format.components),
            "has_audio": False,
            "video.g": KEY_FRAME_EVERY,
            "is_depth_map": False,
        }


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Returns a PNG file."""
    # This level takes a third of the time of FFmpeg's default, for an eighth more bytes.
    return still(pixels, "png", "rgb24", {"compression_level": "1"})


def still(pixels: Pixels, encoder: str, pixel_format: str, options: dict[str, str]) -> bytes:
    """Encodes a file of one image; encoder and pixel format have FFmpeg's names."""
    av = library("av")
    codec = av.CodecContext.create(encoder, "w")
    codec.height, codec.width = pixels.shape[:2]
    codec.pix_fmt, codec.time_base = pixel_format, Fraction(1, 1)
    codec.options = options
    written = BytesIO()
    for packet in [*codec.encode(av.VideoFrame.from_ndarray(pixels, format=pixel_format)), *codec.encode(None)]:
        written.write(bytes(packet))
    return written.getvalue()
