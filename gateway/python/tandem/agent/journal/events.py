"""Events of a conversation, each a line of JSON. Replaying them gives the same conversation."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from typing import Any, TypeAlias

from ..conversation import Answer, Call, Picture, Reply, Told, Usage
from ..tools import Tool


def now() -> str:
    """Returns the current time in UTC, in the form for events."""
    return datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


@dataclass(frozen=True)
class Begun:
    """The conversation begins."""

    conversation: str
    """Random name of the conversation, used in Idempotency-Keys."""

    instructions: str
    tools: tuple[Tool, ...]
    pid: int = field(default_factory=os.getpid)
    """Id of the process that plays."""

    settings: dict[str, Any] | None = None
    """Settings of the model; None in files of format 1."""

    at: str | None = None
    """Time in UTC; None in files of format 1."""


@dataclass(frozen=True)
class Replied:
    """The model replied. The reply is written before anything is done about it."""

    reply: Reply
    usage: Usage
    """Token counts from the endpoint, or an estimate."""

    usd: float | None
    model_s: float
    """Response time of the model."""

    halves: bool
    """True if the conversation had become too long, so that its older half is dropped before this reply."""

    seconds: float
    """The agent's time up to now, without gaps between processes."""


@dataclass(frozen=True)
class Noted:
    """The server has recorded the notes on the latest reply."""


@dataclass(frozen=True)
class Answered:
    """A call of the latest reply was answered."""

    answer: Answer
    called: bool
    """False if the call was not made, for example after the last allowed one."""

    over: bool
    """True once the episode is over for this model."""

    phases: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class Halved:
    """The endpoint found the conversation too long, and its older half was dropped."""


@dataclass(frozen=True)
class Resumed:
    """Another process resumes the conversation."""

    at: str = field(default_factory=now)
    pid: int = field(default_factory=os.getpid)


@dataclass(frozen=True)
class Ended:
    """The model's play has ended."""


Event: TypeAlias = Begun | Replied | Noted | Answered | Told | Halved | Resumed | Ended

_NAMES: dict[type[Event], str] = {
    Begun: "begun",
    Replied: "replied",
    Noted: "noted",
    Answered: "answered",
    Told: "told",
    Halved: "halved",
    Resumed: "resumed",
    Ended: "ended",
}


def written(event: Event) -> dict[str, Any]:
    """Returns an event in its JSON form."""
    return {"event": _NAMES[type(event)], **asdict(event)}


def read(line: dict[str, Any]) -> Event:
    """Parses an event. Raises KeyError, TypeError or ValueError if a line is none."""
    fields = {name: value for name, value in line.items() if name != "event"}
    match line["event"]:
        case "begun":
            fields["tools"] = tuple(Tool(**tool) for tool in fields["tools"])
            return Begun(**fields)
        case "replied":
            fields["reply"], fields["usage"] = _reply(fields["reply"]), Usage(**fields["usage"])
            return Replied(**fields)
        case "noted":
            return Noted()
        case "answered":
            fields["answer"], fields["phases"] = _answer(fields["answer"]), tuple(fields["phases"])
            return Answered(**fields)
        case "told":
            return Told(**fields)
        case "halved":
            return Halved()
        case "resumed":
            return Resumed(**fields)
        case "ended":
            return Ended()
        case other:
            raise ValueError(f"there is no event {other!r}")


def _reply(fields: dict[str, Any]) -> Reply:
    fields["calls"] = tuple(Call(**call) for call in fields["calls"])
    fields["usage"] = None if fields["usage"] is None else Usage(**fields["usage"])
    return Reply(**fields)


def _answer(fields: dict[str, Any]) -> Answer:
    fields["call"], fields["pictures"] = Call(**fields["call"]), tuple(Picture(**each) for each in fields["pictures"])
    return Answer(**fields)
