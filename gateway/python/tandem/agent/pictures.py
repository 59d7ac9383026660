"""Pictures out of replies, and what becomes of those that are no longer shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

from .conversation import Answer, Answers, Picture, Turn, listed


def take_pictures(reply: dict[str, Any]) -> tuple[Picture, ...]:
    """Takes the pictures out of a reply of the server, where it shows something itself or at the end of a command."""
    seen = [reply, reply.get("observation")]
    return tuple(picture for part in seen if isinstance(part, dict) for picture in _own(cast("dict[str, Any]", part)))


def _own(part: dict[str, Any]) -> list[Picture]:
    images = listed(part.pop("images", None))
    return [Picture(str(image["robot"]), float(part["time_s"]), str(image["png_base64"])) for image in images]


def forget_pictures(turns: Sequence[Turn], keep: int) -> list[Turn]:
    """The turns with the latest `keep` pictures, and a line of text in place of each older one."""
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


def count_pictures(turns: Sequence[Turn]) -> int:
    """How many pictures the turns show."""
    return sum(len(answer.pictures) for turn in turns if isinstance(turn, Answers) for answer in turn.answers)
