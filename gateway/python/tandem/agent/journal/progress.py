"""The state of a conversation, as its events have made it."""

from __future__ import annotations

from ..conversation import Answer, Answers, Told
from ..limits import Ledger
from ..memory import Memory
from ..settings import AgentSettings
from .events import Answered, Begun, Ended, Event, Halved, Noted, Replied, Resumed


class Progress:
    """Memory and usage of a model, and what remains to be done about its latest reply. All of it changes by events
    alone, so that those of a file lead where they led before.
    """

    def __init__(self, settings: AgentSettings, opening: str) -> None:
        self.memory = Memory(opening)
        self.ledger = Ledger(settings.limits, settings.prices)
        self.pending: Replied | None = None
        """The latest reply, until its calls are answered or the model is told something."""

        self.answered: list[Answer] = []
        """The answers to the calls of that reply so far."""

        self.noted = False
        """Whether the server has the notes on that reply."""

        self.silent = 0
        """Replies without a call, one after another, up to the latest."""

        self.over = False
        self.phases: tuple[str, ...] = ()
        self.processes = 1
        """How many processes have played."""

        self.seconds = 0.0
        """The agent's time up to the latest event that says it."""

    def apply(self, event: Event) -> None:
        """Has an event change the state."""
        match event:
            case Replied():
                self._apply_reply(event)
            case Answered():
                self._apply_answer(event)
            case Told():
                self.memory.add(event)
                self.pending = None
            case Halved():
                self.memory.halve()
            case Noted():
                self.noted = True
            case Resumed():
                self.processes += 1
            case Ended():
                self.over = True
            case Begun():
                pass

    def _apply_reply(self, event: Replied) -> None:
        self.ledger.add(event.usage, event.usd)
        if event.halves:
            self.memory.halve()
        self.memory.add(event.reply)
        self.pending, self.answered, self.noted = event, [], False
        self.silent = 0 if event.reply.calls else self.silent + 1
        self.seconds = event.seconds

    def _apply_answer(self, event: Answered) -> None:
        self.ledger.calls += int(event.called)
        self.answered.append(event.answer)
        self.over, self.phases, self.seconds = event.over, event.phases, event.seconds
        if self.pending is not None and len(self.answered) == len(self.pending.reply.calls):
            self.memory.add(Answers(tuple(self.answered)))
            self.pending = None
