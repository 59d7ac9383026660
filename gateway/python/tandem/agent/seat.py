"""A seat at an episode: the model's briefing, its tools, and the record of its notes."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, cast

from ..client import Client
from ..errors import EpisodeEnded, Refused, SimulatorFailed
from .conversation import Answer, Call, Ending, Picture, listed
from .tools import Tool, offered

MAX_ANSWER_CHARACTERS = 60_000
"""Maximum length of a reply for the model; the rest is cut off."""

MAX_NOTE_CHARACTERS = 50_000
MAX_NAME_CHARACTERS = 200
"""Limits of the server on a note's text and on the model's name."""

LONGEST_WAIT_S = 30.0
BUSY_TRIES = 5
"""Longest wait and number of tries for a server that is too busy."""

_OVER = ("task_complete", "step_budget_exhausted")


@dataclass(frozen=True)
class Note:
    """The model's text and its cost, in the server's form."""

    text: str
    kind: str
    """One of "thought", "message" and "note"."""

    robot: str | None
    tokens: dict[str, int] | None = None
    usd: float | None = None
    model: str | None = None
    seconds: float | None = None
    ending: Ending | None = None
    """Ending of the model's play with this note; None while it goes on."""


class Seat:
    """One episode on a server, for a client that controls all robots or one of them.

    Args:
        robot: The only robot that is controlled; the client's token is then its operator's. None: all robots.
        tools: Tools of the model. None: those that the server offers.
    """

    def __init__(self, client: Client, episode_id: str, robot: str | None = None, tools: Sequence[Tool] | None = None) -> None:
        self.client = client
        self.episode_id = episode_id
        self.robot = robot
        self.tools: tuple[Tool, ...] = offered(client, episode_id) if tools is None else tuple(tools)
        self.over = False
        self.phases: tuple[str, ...] = ()
        """Phases reached up to now, from the latest reply that has them."""
        self._keeps_notes = True

    @cached_property
    def briefing(self) -> dict[str, Any]:
        """Briefing of the episode."""
        return self.client.request("GET", f"/v1/episodes/{self.episode_id}/briefing")

    def call(self, call: Call, key: str) -> Answer:
        """Makes a tool call of the model. A refusal is also an answer, and says what would have worked.

        Args:
            key: Idempotency-Key of the call.
        """
        tool = next((tool for tool in self.tools if tool.name == call.tool), None)
        if tool is None:
            names = ", ".join(tool.name for tool in self.tools)
            return Answer(call, f"no tool {call.tool!r}; have: {names}", refused=True)
        try:
            given = json.loads(call.arguments or "{}")
        except ValueError as error:
            return Answer(
                call, f"the arguments are no JSON ({error}); give an object that fits the tool's schema", refused=True
            )
        if not isinstance(given, dict):
            return Answer(call, "the arguments are no JSON object; give one that fits the tool's schema", refused=True)
        arguments = cast("dict[str, Any]", given)
        if tool.takes("short") and arguments.get("short") is None:
            arguments["short"] = True
        try:
            reply = self._post(tool.name, arguments, key)
        except EpisodeEnded as ended:
            self.over = True
            return Answer(call, ended.detail, refused=True)
        except SimulatorFailed as failed:
            self.over = True
            return Answer(call, failed.detail, refused=True)
        except Refused as refused:
            return Answer(call, refused.detail, refused=True)
        self.over = self.over or tool.name == "finish" or any(_is_last(part) for part in _parts(reply))
        for part in _parts(reply):
            phases = part.get("phases")
            if isinstance(phases, list):
                # A short reply tells the latest alone.
                told = (f"{phase['number']} {phase['id']}" for phase in listed(phases))
                self.phases += tuple(phase for phase in told if phase not in self.phases)
        pictures = _take_pictures(reply)
        text = json.dumps(reply, separators=(",", ":"), ensure_ascii=False)
        if len(text) > MAX_ANSWER_CHARACTERS:
            text = f"{text[:MAX_ANSWER_CHARACTERS]} ... ({len(text)} characters; the rest is not shown: ask for less)"
        return Answer(call, text, pictures)

    def _post(self, tool: str, arguments: dict[str, Any], key: str) -> dict[str, Any]:
        path = f"/v1/episodes/{self.episode_id}/tools/{tool}"
        for _ in range(BUSY_TRIES):
            try:
                return self.client.request("POST", path, arguments, key=key)
            except Refused as refused:
                if refused.retry_after_s is None:
                    raise
                time.sleep(min(refused.retry_after_s, LONGEST_WAIT_S))
        return self.client.request("POST", path, arguments, key=key)

    def finish(self, key: str) -> None:
        """Finishes the episode for this caller, unless it is over."""
        if not self.over:
            self.call(Call("", "finish", "{}"), key)

    def note(self, note: Note, key: str) -> None:
        """Sends the model's text to the server, which records it once per key."""
        if not self._keeps_notes:
            return
        try:
            # Older servers do not support endings.
            said = {name: value for name, value in asdict(note).items() if name != "ending" or value is not None}
            body = {
                **said,
                "text": note.text[:MAX_NOTE_CHARACTERS],
                "model": (note.model or "")[:MAX_NAME_CHARACTERS],
            }
            self.client.request("POST", f"/v1/episodes/{self.episode_id}/notes", body, key=key)
        except Refused as refused:
            # A failed note must not end the play. Older servers take no notes, and neither do ended episodes.
            self._keeps_notes = refused.kind not in ("no-route", "ended")


def _parts(reply: dict[str, Any]) -> list[dict[str, Any]]:
    """Returns a reply, and for several commands also the reply to the last one."""
    last = reply.get("last")
    return [reply, cast("dict[str, Any]", last)] if isinstance(last, dict) else [reply]


def _is_last(reply: dict[str, Any]) -> bool:
    """Returns true if a reply is the last of its episode."""
    return reply.get("stop_reason") in _OVER or reply.get("ended") is not None


def _take_pictures(reply: dict[str, Any]) -> tuple[Picture, ...]:
    """Takes the images out of a server's reply, from its own fields and from its observation."""
    seen = [reply, reply.get("observation")]
    return tuple(picture for part in seen if isinstance(part, dict) for picture in _take_own(cast("dict[str, Any]", part)))


def _take_own(part: dict[str, Any]) -> list[Picture]:
    images = [*listed(part.pop("images", None)), *listed(part.pop("depth_images", None))]
    return [_picture(image, float(part["time_s"])) for image in images]


def _picture(image: dict[str, Any], time_s: float) -> Picture:
    depth_m = (float(image["white_m"]), float(image["black_m"])) if "white_m" in image else None
    return Picture(str(image["robot"]), time_s, str(image["png_base64"]), depth_m)
