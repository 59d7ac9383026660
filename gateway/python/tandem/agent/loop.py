"""The main loop: it asks the model, makes the model's calls and returns the answers, until the episode is over."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from ..errors import TandemError
from .apis import EndpointError, Filtered, Model, TooLong, without_keys
from .conversation import Answer, Reply, Stopped, Told, Usage
from .instructions import CUT_NUDGE, NUDGE, OPENING
from .journal import Answered, Begun, Ended, Event, Halved, Journal, Noted, Progress, Replied, Resumed
from .limits import Ledger
from .memory import CHARACTERS_A_TOKEN, estimate
from .seat import Note, Seat
from .settings import AgentSettings

MAX_SILENT_TURNS = 2
"""Number of consecutive replies without a call after which the episode is finished."""

MAX_CUTS = 4
"""Maximum number of times a conversation is halved that an endpoint finds too long."""

SHOWN_CHARACTERS = 200

Printer = Callable[[str], None]


@dataclass(frozen=True)
class Played:
    """Outcome of a model's play."""

    ledger: Ledger
    stopped: Stopped | None
    """Reason why the agent finished the episode. None: the model did so itself, or the episode ended."""


class Player:
    """A model that plays an episode.

    Args:
        begun: The first event, with the model's instructions.
        journal: Journal of the events. If it has events of earlier processes, the play continues after them.
    """

    def __init__(
        self, seat: Seat, model: Model, settings: AgentSettings, show: Printer, begun: Begun, journal: Journal
    ) -> None:
        self._seat = seat
        self._model = model
        self._settings = settings
        self._show = show
        self._begun = begun
        self._journal = journal
        # Estimate for endpoints that do not report token counts.
        texts = [begun.instructions, *(f"{tool.description}{json.dumps(tool.schema)}" for tool in begun.tools)]
        self._begun_tokens = sum(len(text) for text in texts) // CHARACTERS_A_TOKEN
        self._progress = Progress(settings, OPENING)
        for event in journal.earlier:
            self._progress.apply(event)
        self._ledger.take_up(self._progress.seconds)
        seat.over, seat.phases = self._progress.over, self._progress.phases

    @property
    def _ledger(self) -> Ledger:
        return self._progress.ledger

    def play(self) -> Played:
        """Plays until the episode is over for this caller."""
        if self._journal.earlier and not self._seat.over:
            self._take_up()
        if self._settings.sampling.told and self._ledger.requests == 0:
            told = f"sampling: {json.dumps(self._settings.sampling.told)}"
            self._seat.note(Note(told, "note", self._seat.robot, model=self._settings.model), self._key("sampling"))
        try:
            stopped = self._play()
        except EndpointError as error:
            # A broken endpoint is not an ending of the model, so the error is raised. It is noted for readers of
            # the recording.
            with suppress(TandemError):
                self._end(Stopped("context" if isinstance(error, TooLong) else "endpoint", without_keys(str(error))))
            raise
        if stopped is not None:
            self._end(stopped)
        self._seat.finish(self._key("finish"))
        self._record(Ended())
        return Played(self._ledger, stopped)

    def _take_up(self) -> None:
        """Notes in the recording that another process resumes the conversation."""
        resumed = Resumed()
        self._record(resumed)
        done = f"after {self._ledger.requests} replies and {self._ledger.calls} calls"
        self._show(f"taken up again {done}")
        told = f"conversation taken up again at {resumed.at}, {done}"
        key = self._key(f"resumed-{self._progress.processes}")
        self._seat.note(Note(told, "note", self._seat.robot, model=self._settings.model), key)

    def _play(self) -> Stopped | None:
        pending = self._progress.pending
        stopped = self._heed(pending) if pending is not None else None
        while stopped is None and not self._seat.over:
            stopped = self._ledger.reason_to_stop()
            if stopped is None:
                try:
                    replied = self._ask()
                except Filtered as filtered:
                    return Stopped("content_filter", str(filtered))
                stopped = self._heed(replied)
        return stopped

    def _heed(self, replied: Replied) -> Stopped | None:
        """Executes a reply, except what is already done. Returns the reason why the model stops, if it does."""
        if not self._progress.noted:
            self._tell(replied)
            self._record(Noted())
        reply = replied.reply
        if reply.calls:
            self._answer(reply)
            return None
        if reply.refusal is not None:
            return Stopped("refused", reply.refusal)
        if reply.filtered:
            return Stopped("content_filter", reply.words)
        if self._progress.silent >= MAX_SILENT_TURNS:
            return Stopped("silent", reply.words)
        self._record(Told(CUT_NUDGE if reply.cut else NUDGE))
        return None

    def _end(self, stopped: Stopped) -> None:
        """Reports the ending of the model's play to watchers and to the server."""
        self._show(f"stopped: {stopped.told}")
        note = Note(stopped.text, "note", self._seat.robot, model=self._settings.model, ending=stopped.ending)
        self._seat.note(note, self._key(stopped.ending))

    def _ask(self) -> Replied:
        """Asks the model, with a shorter conversation if it is too long, and counts the usage."""
        began_s = time.monotonic()
        memory = self._progress.memory
        for _ in range(MAX_CUTS):
            try:
                reply = self._model.ask(self._begun.instructions, self._begun.tools, memory.turns)
                break
            except TooLong:
                if not memory.halve():
                    raise
                self._journal.write(Halved())
        else:
            reply = self._model.ask(self._begun.instructions, self._begun.tools, memory.turns)
        usage = reply.usage or Usage(self._begun_tokens + memory.estimate(), estimate(reply))
        replied = Replied(
            reply=reply,
            usage=usage,
            usd=self._ledger.price(usage),
            model_s=time.monotonic() - began_s,
            halves=usage.input > self._settings.context_tokens,
            seconds=self._ledger.seconds,
        )
        self._record(replied)
        return replied

    def _tell(self, replied: Replied) -> None:
        """Shows the model's text, and sends it to the server with its cost."""
        reply, usage, usd, number = replied.reply, replied.usage, replied.usd, self._ledger.requests
        price = "" if usd is None else f", {usd:.4f} US dollars"
        counted = f"{usage.input} tokens read ({usage.cached} cached), {usage.output} written{price}"
        self._show(f"{replied.model_s:.1f} s, {counted}")
        robot, model = self._seat.robot, self._settings.model
        if reply.thoughts:
            self._show(f"thinks: {reply.thoughts}")
            self._seat.note(Note(reply.thoughts, "thought", robot, model=model), self._key(f"{number}-thought"))
        if reply.words:
            self._show(f"says: {reply.words}")
        tokens = {"input": usage.input, "output": usage.output, "cached": usage.cached}
        told_tokens = tokens if reply.usage is not None else None
        # A note without text only reports the usage.
        note = Note(reply.words, "message", robot, told_tokens, usd, model, round(replied.model_s, 3))
        self._seat.note(note, self._key(f"{number}-message"))

    def _answer(self, reply: Reply) -> None:
        """Makes the unanswered calls of a reply in order, within the limit."""
        number = self._ledger.requests
        for index, call in list(enumerate(reply.calls))[len(self._progress.answered) :]:
            most = self._ledger.limits.calls
            if self._seat.over:
                self._keep(Answer(call, "not called: the episode is over", refused=True), called=False)
            elif most is not None and self._ledger.calls >= most:
                self._keep(Answer(call, f"not called: all of {most} calls were made", refused=True), called=False)
            else:
                reached = self._seat.phases
                answer = self._seat.call(call, self._key(f"{number}-{index}"))
                self._keep(answer, called=True)
                pictures = f" and {len(answer.pictures)} pictures" if answer.pictures else ""
                self._show(f"{call.tool} {_short(call.arguments)}")
                self._show(f"  {'refused: ' if answer.refused else ''}{_short(answer.text)}{pictures}")
                for phase in self._seat.phases[len(reached) :]:
                    self._show(f"reached: {phase}")

    def _keep(self, answer: Answer, *, called: bool) -> None:
        self._record(Answered(answer, called, self._seat.over, self._seat.phases, self._ledger.seconds))

    def _record(self, event: Event) -> None:
        """Writes an event and applies it to the state."""
        self._journal.write(event)
        self._progress.apply(event)

    def _key(self, what: str) -> str:
        """Returns the Idempotency-Key of a request of this conversation, which is the same in every process."""
        return f"{self._begun.conversation}-{what}"


def _short(text: str) -> str:
    return text if len(text) <= SHOWN_CHARACTERS else text[: SHOWN_CHARACTERS - 3] + "..."
