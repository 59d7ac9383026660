"""Statistics of columns and images, with LeRobot's names. They are exact. LeRobot itself takes quantiles from
histograms, and averages episodes' quantiles for a whole data set.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from typing_extensions import Self

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}

FEWEST_SAMPLES = 100
MAX_SAMPLES = 10_000
SAMPLED_POWER = 0.75

LARGEST_SIDE_PX = 300
SAMPLED_SIDE_PX = 150

Statistics = dict[str, Any]


def of_numbers(values: NDArray[Any]) -> Statistics:
    """Returns the statistics of each column of an array."""
    numbers = np.reshape(np.asarray(values, np.float64), (len(values), -1))
    found: Statistics = {
        "min": numbers.min(axis=0).tolist(),
        "max": numbers.max(axis=0).tolist(),
        "mean": numbers.mean(axis=0).tolist(),
        "std": numbers.std(axis=0).tolist(),
        "count": [len(numbers)],
    }
    quantiles = np.quantile(numbers, list(QUANTILES.values()), axis=0)
    return found | {name: row.tolist() for name, row in zip(QUANTILES, quantiles, strict=True)}


def sampled(pictures: int) -> set[int]:
    """Returns the images of an episode whose colours are counted, in the same number as in LeRobot."""
    fewest = min(FEWEST_SAMPLES, pictures)
    count = max(fewest, min(int(pictures**SAMPLED_POWER), MAX_SAMPLES))
    return set(np.round(np.linspace(0, pictures - 1, count)).astype(int).tolist())


class Levels:
    """Histograms of the levels of each channel in images."""

    channels: ClassVar[int]
    values: ClassVar[NDArray[np.float64]]
    """Values of the levels."""

    def __init__(self, pictures: int = 0, levels: Sequence[Sequence[int]] | None = None) -> None:
        self.pictures = pictures
        shape = (self.channels, len(self.values))
        self.levels = np.zeros(shape, np.int64) if levels is None else np.asarray(levels, np.int64)

    def add(self, pixels: NDArray[Any]) -> None:
        """Counts an image, height by width by channels if there are several. Only every n-th pixel of a large image
        is counted.
        """
        height, width = pixels.shape[:2]
        if max(width, height) >= LARGEST_SIDE_PX:
            factor = max(width, height) // SAMPLED_SIDE_PX
            pixels = pixels[::factor, ::factor]
        self.pictures += 1
        for channel in range(self.channels):
            seen = pixels if self.channels == 1 else pixels[..., channel]
            self.levels[channel] += np.bincount(seen.ravel(), minlength=len(self.values))

    def __add__(self, other: Self) -> Self:
        return type(self)(self.pictures + other.pictures, (self.levels + other.levels).tolist())

    def statistics(self) -> Statistics:
        """Returns the statistics of each channel in the shape of images: channels by one by one."""
        counted, level = self.levels, self.values
        total = counted.sum(axis=1)
        mean = counted @ level / total
        deviation = np.sqrt(np.maximum(counted @ level**2 / total - mean**2, 0.0))
        below = counted.cumsum(axis=1) / total[:, None]

        def at(share: float) -> NDArray[np.float64]:
            return level[(below >= share).argmax(axis=1)]

        seen = counted > 0
        rows = {
            "min": level[seen.argmax(axis=1)],
            "max": level[len(level) - 1 - seen[:, ::-1].argmax(axis=1)],
            "mean": mean,
            "std": deviation,
            **{name: at(share) for name, share in QUANTILES.items()},
        }
        return {**{name: [[[value]] for value in row.tolist()] for name, row in rows.items()}, "count": [self.pictures]}


class Colours(Levels):
    """Histograms of red, green and blue, from 0 to 1."""

    channels = 3
    values = np.arange(256) / 255
