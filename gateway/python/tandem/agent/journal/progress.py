"""State of a conversation after its events."""

from __future__ import annotations

from ..conversation import Answer, Answers, Told
from ..limits import Ledger
from ..memory import Memory
from ..settings import AgentSettings
from .events import Answered, Begun, Ended, Event, Halved, Noted, Replied, Resumed


class Progress:
    """Memory and usage of a model, and the open work on its latest reply. Only events change it, so that replaying
    a file restores the same state.
    """

    def __init__(self, settings: AgentSettings, opening: str) -> None:
        self.memory = Memory(opening)
        self.ledger = Ledger(settings.limits, settings.prices)
        self.pending: Replied | None = None
        """Latest reply, until its calls are answered or the model gets a message."""

        self.answered: list[Answer] = []
        """Answers to the calls of that reply up to now."""

        self.noted = False
        """True once the server has the notes on that reply."""

        self.silent = 0
        """Number of consecutive replies without a call, up to the latest."""

        self.over = False
        self.phases: tuple[str, ...] = ()
        self.processes = 1
        """Number of processes that have played."""

        self.seconds = 0.0
        """The agent's time up to the latest event that has it."""

    def apply(self, event: Event) -> None:
        """Applies an event to the state."""
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
