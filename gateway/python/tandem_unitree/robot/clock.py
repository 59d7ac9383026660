"""Clock of a robot's control steps."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from .sensing import STEP_S

ClockKind: TypeAlias = Literal["real", "hold"]
"""`real`: time passes as for a robot, so thinking costs. `hold`: time stands still while no program commands."""

HOLD_AFTER_S = 0.5
"""Time without a message after which the clock `hold` stands still."""

MAX_LATE_STEPS = 5
"""Steps in a row that may be late before the clock looks whether they really are."""


class PictureTurns:
    """Decides after which control steps a robot fetches a picture.

    Robots take turns, so that no control step waits for more than one picture.

    number: Which of the robots it is, from 0.
    """

    def __init__(self, number: int, fps: float) -> None:
        self._number = number
        self._steps = max(1, round(1.0 / (fps * STEP_S)))
        self._turn: int | None = None

    def is_due(self, now_s: float) -> bool:
        """Returns whether to fetch a picture after the control step that has just ended."""
        turn = (int(now_s / STEP_S) - self._number) // self._steps
        due = turn != self._turn
        self._turn = turn
        return due


class LastMessage(Protocol):
    """The time of the last message of any program, which the processes of an episode's robots share."""

    value: float
    """Time by the monotonic clock, [s]; 0 if there was none yet."""


@dataclass
class OwnLastMessage:
    """The time of the last message of one robot's programs."""

    value: float = 0.0


class Clock:
    """Decides whether a control step is made, and when the next one is due.

    All processes on a machine share the monotonic clock, and steps are due at its multiples of 20 ms, so the robots of an
    episode command at the same time and none waits for another.
    """

    def __init__(
        self, kind: ClockKind, last_message: LastMessage | None = None, monotonic_s: Callable[[], float] = time.monotonic
    ) -> None:
        self._kind = kind
        self._monotonic_s = monotonic_s
        self._last_message = OwnLastMessage() if last_message is None else last_message
        self._slot = int(monotonic_s() / STEP_S)
        self._late = 0
        self._late_since_s = 0.0

    def heard(self) -> None:
        """Notes that a program has sent a message."""
        self._last_message.value = self._monotonic_s()

    def passes(self, walks: bool) -> bool:
        """Returns whether time passes; `walks` says that a velocity is in force."""
        if walks:
            self.heard()
        return self._kind == "real" or self._monotonic_s() - self._last_message.value < HOLD_AFTER_S

    def wait_s(self) -> float:
        """Returns the seconds until the next control step is due.

        A step that took longer than 20 ms is followed by the next one at once. Where that goes on though steps come every
        20 ms, this robot commands early and waits for a partner, and it goes back to the multiples of 20 ms.
        """
        now_s = self._monotonic_s()
        slot = int(now_s / STEP_S)
        if slot <= self._slot:
            self._slot, self._late = self._slot + 1, 0
            return self._slot * STEP_S - now_s
        if self._late == 0:
            self._late_since_s = now_s
        self._late += 1
        self._slot = slot
        if self._late > MAX_LATE_STEPS:
            is_early = now_s - self._late_since_s < 1.05 * MAX_LATE_STEPS * STEP_S
            self._late = 0
            if is_early:
                self._slot = slot + 1
                return self._slot * STEP_S - now_s
        return 0.0
