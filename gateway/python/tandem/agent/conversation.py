"""The conversation between a model, the episode and the agent, independent of any API."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

Ending: TypeAlias = Literal[
    "success",
    "finished",
    "refused",
    "content_filter",
    "silent",
    "token_limit",
    "price_limit",
    "call_limit",
    "time_limit",
    "context",
    "endpoint",
]
"""Ending of a model's play, as named in results."""


@dataclass(frozen=True)
class Stopped:
    """Reason why a model stops, unless the episode itself has ended."""

    ending: Ending
    text: str
    """Text of the model (for example a refusal) or of its endpoint, or the limit that was reached."""

    @property
    def told(self) -> str:
        """Text for watchers."""
        said = _SAID.get(self.ending)
        return self.text if said is None else f"{said}: {self.text}" if self.text else said


_SAID: dict[str, str] = {
    "refused": "the model refused",
    "content_filter": "a content filter held back the model's reply",
    "silent": "the model called no tool, twice in turn",
    "context": "the conversation became too long for the model",
    "endpoint": "the model's endpoint gave no reply",
}
"""Explanations of endings that are missing in their texts."""


@dataclass(frozen=True)
class Picture:
    """Image of a robot's camera, as a PNG file."""

    robot: str
    time_s: float
    png_base64: str
    depth_m: Sequence[float] | None = None
    """Depths that are white and black in an image of depth."""

    @property
    def caption(self) -> str:
        """Caption of the image for the model."""
        if self.depth_m is None:
            return f"Camera of {self.robot} at {self.time_s:.2f} s:"
        white_m, black_m = self.depth_m
        scale = f"grey linear in 1 / depth, white {white_m} m, black {black_m} m or nothing"
        return f"Depth of {self.robot} at {self.time_s:.2f} s, {scale}:"


@dataclass(frozen=True)
class Call:
    """A tool call of the model."""

    call_id: str
    tool: str
    arguments: str
    """Arguments as JSON, as the model wrote it."""


@dataclass(frozen=True)
class Answer:
    """Answer to a call."""

    call: Call
    text: str
    pictures: tuple[Picture, ...] = ()
    refused: bool = False


@dataclass(frozen=True)
class Usage:
    """Token counts of one request."""

    input: int
    """Input tokens, cached or not."""

    output: int
    """Output tokens, reasoning included."""

    cached: int = 0
    """Part of `input` that was read from a cache."""

    cache_written: int = 0
    """Part of `input` that was written to a cache at its own price."""


@dataclass(frozen=True)
class Told:
    """Message of the agent to the model."""

    text: str


@dataclass(frozen=True)
class Reply:
    """Reply of the model."""

    words: str
    thoughts: str
    calls: tuple[Call, ...]
    usage: Usage | None
    """Token counts; None if the endpoint does not report them."""

    as_sent: Any
    """The reply in its API's own form, in which it is sent back."""

    cut: bool = False
    """True if the reply was cut off at the token limit."""

    refusal: str | None = None
    """Text of a refusal; None if the model did not refuse."""

    filtered: bool = False
    """True if a filter of the endpoint withheld the reply."""

    retries: int = 0
    """Number of failed requests before the one that got the reply."""


@dataclass(frozen=True)
class Answers:
    """Answers to a reply's calls, in order."""

    answers: tuple[Answer, ...]


def listed(value: Any) -> list[Any]:
    """Returns a JSON list, or an empty one if it is missing."""
    return list(value) if value else []


Turn: TypeAlias = Told | Reply | Answers
