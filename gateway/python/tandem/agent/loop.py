"""The loop: the model is asked, its calls are made, and it is told what came of them, until the episode is over."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from ..errors import TandemError
from .apis import EndpointError, Filtered, Model, TooLong, without_keys
from .conversation import Answer, Answers, Reply, Stopped, Told, Usage
from .instructions import CUT_NUDGE, NUDGE, OPENING, instructions
from .limits import Ledger
from .memory import CHARACTERS_A_TOKEN, Memory, estimate
from .seat import Note, Seat
from .settings import AgentSettings

MOST_SILENT = 2
"""Replies without a call, one after another, after which the episode is finished."""

MOST_CUTS = 4
"""How often a conversation is halved that an endpoint finds too long, before that is the end."""

SHOWN_CHARACTERS = 200

Printer = Callable[[str], None]


@dataclass(frozen=True)
class Played:
    """How a model played."""

    ledger: Ledger
    stopped: Stopped | None
    """Why we finished the episode in its place; None: it did so itself, or the episode ended."""


class Player:
    """A model at an episode."""

    def __init__(self, seat: Seat, model: Model, settings: AgentSettings, show: Printer) -> None:
        self._seat = seat
        self._model = model
        self._settings = settings
        self._show = show
        self._memory = Memory(OPENING, settings.context_tokens)
        self._instructions = instructions(seat)
        # For endpoints that do not count.
        begun = [self._instructions, *(f"{tool.description}{json.dumps(tool.schema)}" for tool in seat.tools)]
        self._begun_tokens = sum(len(text) for text in begun) // CHARACTERS_A_TOKEN
        self._ledger = Ledger(settings.limits, settings.prices)

    def play(self) -> Played:
        """Plays until the episode is over for this caller."""
        if self._settings.sampling.told:
            told = f"sampling: {json.dumps(self._settings.sampling.told)}"
            self._seat.note(Note(told, "note", self._seat.robot, model=self._settings.model))
        try:
            stopped = self._play()
        except EndpointError as error:
            # That the endpoint is broken is no end of the model's, and is raised; whoever reads the episode is told.
            with suppress(TandemError):
                self._end(Stopped("context" if isinstance(error, TooLong) else "endpoint", without_keys(str(error))))
            raise
        if stopped is not None:
            self._end(stopped)
        self._seat.finish()
        return Played(self._ledger, stopped)

    def _play(self) -> Stopped | None:
        silent = 0
        while not self._seat.over:
            stopped = self._ledger.reason_to_stop()
            if stopped is not None:
                return stopped
            try:
                reply = self._ask()
            except Filtered as filtered:
                return Stopped("content_filter", str(filtered))
            self._memory.add(reply)
            if reply.calls:
                silent = 0
                self._memory.add(Answers(tuple(self._answer(reply))))
                continue
            if reply.refusal is not None:
                return Stopped("refused", reply.refusal)
            if reply.filtered:
                return Stopped("content_filter", reply.words)
            silent += 1
            if silent >= MOST_SILENT:
                return Stopped("silent", reply.words)
            self._memory.add(Told(CUT_NUDGE if reply.cut else NUDGE))
        return None

    def _end(self, stopped: Stopped) -> None:
        """Says how the model's play ends, to whoever looks on and to the server."""
        self._show(f"stopped: {stopped.told}")
        self._seat.note(Note(stopped.text, "note", self._seat.robot, model=self._settings.model, ending=stopped.ending))

    def _ask(self) -> Reply:
        """Asks the model, with less of the conversation where it is too long for it, and counts what that took."""
        began_s = time.monotonic()
        for _ in range(MOST_CUTS):
            try:
                reply = self._model.ask(self._instructions, self._seat.tools, self._memory.turns)
                break
            except TooLong:
                if not self._memory.halve():
                    raise
        else:
            reply = self._model.ask(self._instructions, self._seat.tools, self._memory.turns)
        seconds = time.monotonic() - began_s
        usage = reply.usage or Usage(self._begun_tokens + self._memory.estimate(), estimate(reply))
        usd = self._ledger.add(usage)
        self._tell(reply, usage, usd, seconds)
        self._memory.trim(usage.input)
        return reply

    def _tell(self, reply: Reply, usage: Usage, usd: float | None, seconds: float) -> None:
        """Shows the model's words, and hands them to the server with what they cost."""
        price = "" if usd is None else f", {usd:.4f} US dollars"
        self._show(f"{seconds:.1f} s, {usage.input} tokens read ({usage.cached} cached), {usage.output} written{price}")
        robot, model = self._seat.robot, self._settings.model
        if reply.thoughts:
            self._show(f"thinks: {reply.thoughts}")
            self._seat.note(Note(reply.thoughts, "thought", robot, model=model))
        if reply.words:
            self._show(f"says: {reply.words}")
        tokens = {"input": usage.input, "output": usage.output, "cached": usage.cached}
        counted = tokens if reply.usage is not None else None
        # Without words it says what was used alone.
        self._seat.note(Note(reply.words, "message", robot, counted, usd, model, round(seconds, 3)))

    def _answer(self, reply: Reply) -> list[Answer]:
        """Makes the calls of a reply in their order, as many as may be made."""
        answers: list[Answer] = []
        for call in reply.calls:
            most = self._ledger.limits.calls
            if self._seat.over:
                answers.append(Answer(call, "not called: the episode is over", refused=True))
            elif most is not None and self._ledger.calls >= most:
                answers.append(Answer(call, f"not called: all of {most} calls were made", refused=True))
            else:
                reached = self._seat.phases
                answer = self._seat.call(call)
                self._ledger.calls += 1
                pictures = f" and {len(answer.pictures)} pictures" if answer.pictures else ""
                self._show(f"{call.tool} {_short(call.arguments)}")
                self._show(f"  {'refused: ' if answer.refused else ''}{_short(answer.text)}{pictures}")
                for phase in self._seat.phases[len(reached) :]:
                    self._show(f"reached: {phase}")
                answers.append(answer)
        return answers


def _short(text: str) -> str:
    return text if len(text) <= SHOWN_CHARACTERS else text[: SHOWN_CHARACTERS - 3] + "..."
