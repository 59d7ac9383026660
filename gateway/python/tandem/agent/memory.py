"""The conversation as sent to the model, shortened when it grows too long."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

from .conversation import Answer, Answers, Reply, Told, Turn

MAX_PICTURES = 20
"""Maximum number of images. Beyond it, only the latest half of this number stays, because each cut makes the
endpoint read its cached input again.
"""

CHARACTERS_A_TOKEN = 4
PICTURE_TOKENS = 300
"""Rough estimates, for endpoints without token counts and for the relative size of turns."""

LISTED_CALLS = 40
LISTED_CHARACTERS = 160


class Memory:
    """The model's memory: the agent's opening, and the latest turns."""

    def __init__(self, opening: str, most_pictures: int = MAX_PICTURES) -> None:
        self._opening = opening
        self._most_pictures = most_pictures
        self._listed: list[str] = []
        self._turns: list[Turn] = []

    @property
    def turns(self) -> Sequence[Turn]:
        """The conversation, beginning with the agent's opening."""
        opening = self._opening
        if self._listed:
            told = "\n".join(self._listed[-LISTED_CALLS:])
            opening = f"{opening}\n\nWhat you did before, in short, the latest last:\n{told}"
        return [Told(opening), *self._turns]

    def add(self, turn: Turn) -> None:
        """Adds a turn. Images are dropped in halves, so that a cache is useful between two cuts."""
        self._turns.append(turn)
        if _count_pictures(self._turns) > self._most_pictures:
            self._turns = _forget_pictures(self._turns, self._most_pictures // 2)

    def halve(self) -> bool:
        """Drops the older half of the turns, except for a list of their calls. Returns False if there is nothing to
        drop.
        """
        # A reply and its answers belong together; the latest such pair stays.
        starts = [index for index, turn in enumerate(self._turns) if isinstance(turn, Reply)]
        sizes = [estimate(turn) for turn in self._turns]
        later = [index for index in starts[1:] if sum(sizes[index:]) * 2 <= sum(sizes)]
        cut = later[0] if later else (starts[-1] if len(starts) > 1 else 0)
        for turn in self._turns[:cut]:
            if isinstance(turn, Answers):
                self._listed += [f"- {_short(a.call.tool + ' ' + a.call.arguments)} -> {_short(a.text)}" for a in turn.answers]
        self._turns = self._turns[cut:]
        return cut > 0

    def estimate(self) -> int:
        """Estimates the number of tokens of all turns."""
        return sum(estimate(turn) for turn in self.turns)


def estimate(turn: Turn) -> int:
    """Estimates the number of tokens of a turn."""
    match turn:
        case Told(text):
            return len(text) // CHARACTERS_A_TOKEN
        case Reply():
            written = len(turn.words) + len(turn.thoughts) + sum(len(call.arguments) for call in turn.calls)
            return written // CHARACTERS_A_TOKEN
        case Answers(answers):
            pictures = PICTURE_TOKENS * sum(len(answer.pictures) for answer in answers)
            return pictures + sum(len(answer.text) for answer in answers) // CHARACTERS_A_TOKEN


def _forget_pictures(turns: Sequence[Turn], keep: int) -> list[Turn]:
    """Keeps the latest `keep` images, and replaces each older one by a line of text."""
    left = keep
    newest_first: list[Turn] = []
    for turn in reversed(turns):
        if isinstance(turn, Answers):
            answers: list[Answer] = []
            for answer in reversed(turn.answers):
                shown = answer.pictures[max(0, len(answer.pictures) - left) :]
                left -= len(shown)
                gone = answer.pictures[: len(answer.pictures) - len(shown)]
                lines = [f"({picture.caption.rstrip(':')}: the picture is no longer shown.)" for picture in gone]
                answers.append(replace(answer, text="\n".join([answer.text, *lines]), pictures=shown) if gone else answer)
            newest_first.append(Answers(tuple(reversed(answers))))
        else:
            newest_first.append(turn)
    return newest_first[::-1]


def _count_pictures(turns: Sequence[Turn]) -> int:
    """Counts the images in the turns."""
    return sum(len(answer.pictures) for turn in turns if isinstance(turn, Answers) for answer in turn.answers)


def _short(text: str) -> str:
    line = json.dumps(text, ensure_ascii=False)[1:-1].replace('\\"', '"')
    return line if len(line) <= LISTED_CHARACTERS else line[: LISTED_CHARACTERS - 3] + "..."
