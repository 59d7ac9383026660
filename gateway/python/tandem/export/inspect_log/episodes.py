"""Episodes that agents have played: their results and their conversations."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

from ...agent.conversation import Answer, Call, Reply, Usage, listed
from ...agent.journal import Answered, Begun, EpisodeFile, Event, Replied, read_result
from ...agent.journal.events import read
from ...errors import TandemError
from ...recording import RecordedCall, Recording
from ..lerobot import RECORDING_FILE

COMBINED = "together"
"""Tool of a recorded call that combines a command of each operator."""

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
    instruction: str
    """Joint instruction of the task."""

    conversations: tuple[Conversation, ...]
    source: str
    """Source of the conversations: "conversation" files, or the "recording", which has only the calls."""

    @property
    def seed(self) -> int:
        """Seed of the episode."""
        return self.result["seed"]

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
    if conversations:
        task = _TASK.search(conversations[0].begun.instructions)
        return Episode(folder, result, task.group(1) if task else "", conversations, "conversation")
    if not (folder / RECORDING_FILE).exists():
        return None
    recording = Recording(folder)
    conversations = tuple(_recorded(recording, {"model": _player(folder, result)}))
    return Episode(folder, result, recording.instruction, conversations, "recording") if conversations else None


def _files(folder: Path) -> list[tuple[Path, str | None]]:
    """Returns the conversation files of an episode with their robots. Programs of an evaluation have a folder for each
    robot.
    """
    own = [(path, None) for path in folder.glob("agent.jsonl")]
    beside = [(path, path.stem.removeprefix("agent-")) for path in folder.glob("agent-*.jsonl")]
    below = [(path, path.parent.name) for path in folder.glob("*/agent.jsonl")]
    # The file of a model that has never begun is empty.
    return [each for each in [*own, *sorted([*beside, *below])] if each[0].stat().st_size > 0]


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


def _player(folder: Path, result: dict[str, Any]) -> str:
    """Names the player of an episode without conversations: by its notes, or by the evaluation's entry."""
    models = listed(result.get("usage", {}).get("models"))
    if models:
        return " + ".join(models)
    try:
        return str(json.loads(folder.with_name(f"{folder.name}.json").read_text(encoding="utf-8"))["policy"])
    except FileNotFoundError:
        return "unknown"


def _recorded(recording: Recording, settings: dict[str, Any]) -> Iterator[Conversation]:
    """Makes conversations of a recording's calls: one for each operator, or one for all robots."""
    ended_at = _written_at(recording.path)
    own: dict[str | None, list[Event]] = {}
    for call in recording.calls:
        for robot, tool, arguments in _commands(call):
            own.setdefault(robot, []).extend(_events(call, tool, arguments))
    begun_at = ended_at - timedelta(seconds=max((call.thought_s for call in recording.calls), default=0.0))
    for robot, events in own.items():
        instruction = recording.instruction if robot is None else recording.instructions[robot]
        yield Conversation(robot, settings, begun_at, (Begun("", instruction, ()), *events))


def _commands(call: RecordedCall) -> list[tuple[str | None, str, Any]]:
    """Returns robot, tool and arguments of the commands that a call combines, or of the call itself."""
    if call.tool != COMBINED:
        return [(call.operator, call.tool, call.arguments)]
    return [(command["robot"], command["tool"], command["arguments"]) for command in call.arguments["commands"]]


def _events(recorded: RecordedCall, tool: str, arguments: Any) -> Iterator[Event]:
    """Yields the events of a call as if it were a reply of its own."""
    call = Call("", tool, json.dumps(arguments))
    yield Replied(Reply("", "", (call,), None, None), Usage(0, 0), None, 0.0, halves=False, seconds=recorded.thought_s)
    refused = recorded.problem is not None
    text = recorded.problem or json.dumps(recorded.reply, separators=(",", ":"), ensure_ascii=False)
    yield Answered(Answer(call, text, refused=refused), True, False, (), recorded.thought_s)


def _written_at(path: Path) -> datetime:
    return datetime.fromtimestamp(path.stat().st_mtime, timezone.utc)


def time_of(text: str) -> datetime:
    """Parses the time of an event."""
    return datetime.strptime(text, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=timezone.utc)
