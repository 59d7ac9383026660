"""What is said between a model, the episode and us, in no API's form."""

from __future__ import annotations

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
"""How a model's play ends, as results have it."""


@dataclass(frozen=True)
class Stopped:
    """Why a model plays no longer, where the episode's own end does not say it."""

    ending: Ending
    text: str
    """The model's words, as of a refusal, or those of its endpoint, or which limit was reached."""

    @property
    def told(self) -> str:
        """What whoever looks on is told."""
        said = _SAID.get(self.ending)
        return self.text if said is None else f"{said}: {self.text}" if self.text else said


_SAID: dict[str, str] = {
    "refused": "the model refused",
    "content_filter": "a content filter held back the model's reply",
    "silent": "the model called no tool, twice in turn",
    "context": "the conversation became too long for the model",
    "endpoint": "the model's endpoint gave no reply",
}
"""What the text of an ending does not say itself."""


@dataclass(frozen=True)
class Picture:
    """What a robot's camera saw, as a PNG file."""

    robot: str
    time_s: float
    png_base64: str

    @property
    def caption(self) -> str:
        """What the model is told beside it."""
        return f"Camera of {self.robot} at {self.time_s:.2f} s:"


@dataclass(frozen=True)
class Call:
    """A tool that the model calls."""

    call_id: str
    tool: str
    arguments: str
    """JSON, as the model wrote it."""


@dataclass(frozen=True)
class Answer:
    """What came of a call."""

    call: Call
    text: str
    pictures: tuple[Picture, ...] = ()
    refused: bool = False


@dataclass(frozen=True)
class Usage:
    """The tokens of one request."""

    input: int
    """All that was read, from a cache or not."""

    output: int
    """All that was written, thoughts included."""

    cached: int = 0
    """Of `input`, what was read from a cache."""

    cache_written: int = 0
    """Of `input`, what was written to a cache at a price of its own."""


@dataclass(frozen=True)
class Told:
    """What we tell the model."""

    text: str


@dataclass(frozen=True)
class Reply:
    """What the model said."""

    words: str
    thoughts: str
    calls: tuple[Call, ...]
    usage: Usage | None
    """None where the endpoint does not count."""

    as_sent: Any
    """The reply in its API's own form, which wants it back so."""

    cut: bool = False
    """Whether it was cut off at the most tokens that a reply may have."""

    refusal: str | None = None
    """The words of a model that refuses; None where it does not."""

    filtered: bool = False
    """Whether a filter of the endpoint held it back."""


@dataclass(frozen=True)
class Answers:
    """What came of a reply's calls, in their order."""

    answers: tuple[Answer, ...]


def listed(value: Any) -> list[Any]:
    """What JSON has as a list, which may be missing."""
    return list(value) if value else []


Turn: TypeAlias = Told | Reply | Answers
