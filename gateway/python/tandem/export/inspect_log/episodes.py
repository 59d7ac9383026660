"""Episodes that agents have played: their results and their conversations."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

from ...agent.conversation import Answer, Call, Reply, Usage
from ...agent.journal import Answered, Begun, EpisodeFile, Event, Replied, read_result
from ...agent.journal.events import read
from ...errors import TandemError
from ...recording import RecordedCall, Recording
from ..lerobot import RECORDING_FILE

_TASK = re.compile(r"^Task: (.*)$", re.MULTILINE)


@dataclass(frozen=True)
class Conversation:
    """Conversation of one model."""

    robot: str | None
    """Robot that the model controlled; None: all robots."""

    settings: dict[str, Any]
    """Settings of the model; empty if it is unknown."""

    begun_at: datetime
    events: tuple[Event, ...]

    @property
    def begun(self) -> Begun:
        """First event."""
        begun = self.events[0]
        assert isinstance(begun, Begun), "no other event is read as the first one"
        return begun

    @property
    def model(self) -> str:
        """Name of the model."""
        return str(self.settings.get("model", "unknown"))


@dataclass(frozen=True)
class Episode:
    """An episode with the conversations of its models."""

    folder: Path
    result: dict[str, Any]
    seed: int
    instruction: str
    """Joint instruction of the task."""

    conversations: tuple[Conversation, ...]
    source: str
    """Source of the conversations: "conversation" files, or the "recording", which has only the calls."""

    @property
    def begun_at(self) -> datetime:
        """Time when the first model began."""
        return min(conversation.begun_at for conversation in self.conversations)


def episodes(root: Path) -> list[Episode]:
    """Returns the ended episodes of agents in a folder and its subfolders, sorted by folder."""
    if not root.is_dir():
        raise TandemError(f"there is no folder {root}; give a folder of episodes, as runs")
    found = [episode for folder in sorted(_folders(root)) if (episode := _episode(folder)) is not None]
    if not found:
        raise TandemError(
            f"no ended episode of an agent in {root}; give a folder that tandem agent, serve, or evaluate with agents wrote"
        )
    return found


def _folders(root: Path) -> Iterator[Path]:
    """Yields the folders with a result. Links are followed, and no folder is entered twice."""
    entered: set[str] = set()
    for folder, below, _ in os.walk(root, followlinks=True):
        real = os.path.realpath(folder)
        if real in entered:
            below.clear()
            continue
        entered.add(real)
        if read_result(Path(folder)) is not None:
            yield Path(folder)


def _episode(folder: Path) -> Episode | None:
    """Reads an episode; returns None if nobody called a tool in it."""
    result = read_result(folder)
    assert result is not None, "only folders with a result are found"
    conversations = tuple(_read(path, robot, folder) for path, robot in _files(folder))
    recording = Recording(folder) if (folder / RECORDING_FILE).exists() else None
    if conversations:
        seed = _seed(folder, result) if recording is None else recording.seed
        task = _TASK.search(conversations[0].begun.instructions)
        instruction = task.group(1) if task else ""
        return Episode(folder, result, seed, instruction, conversations, "conversation")
    if recording is None or not recording.calls:
        return None
    return Episode(folder, result, recording.seed, recording.instruction, tuple(_recorded(recording)), "recording")


def _files(folder: Path) -> list[tuple[Path, str | None]]:
    """Returns the conversation files of an episode with their robots. Programs of an evaluation have a folder for each
    robot.
    """
    own = [(path, None) for path in folder.glob("agent.jsonl")]
    beside = [(path, path.stem.removeprefix("agent-")) for path in folder.glob("agent-*.jsonl")]
    below = [(path, path.parent.name) for path in folder.glob("*/agent.jsonl")]
    return [*own, *sorted([*beside, *below])]


def _read(path: Path, robot: str | None, folder: Path) -> Conversation:
    try:
        # The last line of a killed process may be incomplete.
        lines = path.read_bytes().split(b"\n")[:-1]
        events = tuple(read(json.loads(line)) for line in lines)
        begun = events[0]
        if not isinstance(begun, Begun):
            raise ValueError("it does not begin with the event `begun`")
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise TandemError(f"{path} is no conversation of an agent ({error}); remove it from the folder") from error
    settings = begun.settings if begun.settings is not None else EpisodeFile.read(folder).flags
    at = time_of(begun.at) if begun.at is not None else _written_at(folder / "agent.json")
    return Conversation(robot, settings, at, events)


def _seed(folder: Path, result: dict[str, Any]) -> int:
    """Returns the seed of an episode without a recording, from its result or from the evaluation's entry."""
    if result.get("seed") is not None:
        return result["seed"]
    entry = folder.with_name(f"{folder.name}.json")
    return json.loads(entry.read_text(encoding="utf-8"))["spec"]["seed"]


def _recorded(recording: Recording) -> Iterator[Conversation]:
    """Makes conversations of a recording's calls: one for each operator, or one for all robots."""
    ended_at = _written_at(recording.path)
    for robot in dict.fromkeys(call.operator for call in recording.calls):
        calls = [call for call in recording.calls if call.operator == robot]
        instruction = recording.instruction if robot is None else recording.instructions[robot]
        begun_at = ended_at - timedelta(seconds=calls[-1].thought_s)
        yield Conversation(robot, {}, begun_at, (Begun("", instruction, ()), *_events(calls)))


def _events(calls: Sequence[RecordedCall]) -> Iterator[Event]:
    """Yields the events of calls whose model is unknown, each a reply of its own."""
    for recorded in calls:
        call = Call("", recorded.tool, json.dumps(recorded.arguments))
        reply = Reply("", "", (call,), Usage(0, 0), None)
        yield Replied(reply, Usage(0, 0), None, 0.0, halves=False, seconds=recorded.thought_s)
        refused = recorded.problem is not None
        text = recorded.problem if refused else json.dumps(recorded.reply, separators=(",", ":"), ensure_ascii=False)
        yield Answered(Answer(call, text or "", refused=refused), True, False, (), recorded.thought_s)


def _written_at(path: Path) -> datetime:
    return datetime.fromtimestamp(path.stat().st_mtime, timezone.utc)


def time_of(text: str) -> datetime:
    """Parses the time of an event."""
    return datetime.strptime(text, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=timezone.utc)
