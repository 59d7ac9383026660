"""Instructions for a model before it begins."""

from __future__ import annotations

import json
from typing import Any

from .conversation import listed
from .seat import Seat

OPENING = "The episode has begun. Look first, then act."

NUDGE = (
    "You have called no tool, and nothing has moved. Call a tool to go on; call finish if the task is done or cannot be done. "
    "Another reply without a call ends the episode."
)

CUT_NUDGE = "Your reply was cut off before it called a tool, for it was too long. Think less at a time, and call a tool."


HOW = (
    "Physics stands still while you think: only commands take time. Look with observe, measure with query_depth, act, and "
    "check with every reply what came of it. Call several tools in one reply where you need not see what came of the first; "
    "they are answered in order. Replies are short unless you give short: false. A call that is refused changes nothing, and "
    "says what would have worked. Older pictures and calls are left out of this conversation as it grows, so say in words "
    "what you will need. Write a sentence or two about what you see and intend beside your calls."
)

TOGETHER = "A command is executed when every robot has one, and the shortest ends them all."


def instructions(seat: Seat) -> str:
    """Returns the task, the rules and the briefing as paragraphs. They stay the same through an episode and are
    cached.
    """
    told = seat.briefing
    names = [robot["robot"] for robot in told["robots"]]
    own = names if seat.robot is None else [seat.robot]
    paragraphs = [
        _addressee(own, [name for name in names if name not in own], any(tool.name == "say" for tool in seat.tools)),
        f"Task: {told['instruction']}",
        *(f"Robot {each['robot']}: {each['instruction']}" for each in told["instructions"]),
        *_listed("The phases that are scored, one after another:", [_phase(phase) for phase in listed(told.get("phases"))]),
        *_listed("In the room at the start:", [str(line) for line in listed(told.get("room"))]),
        f"{_budget(told['status']['budget'])} {told['ending']} Call finish, too, when the task cannot be done.",
        *_brief(told["brief"]),
    ]
    return "\n\n".join(paragraphs)


def _addressee(own: list[str], others: list[str], talk: bool) -> str:
    robots = f"robot {own[0]}" if len(own) == 1 else f"robots {', '.join(own)}"
    text = f"You direct the humanoid {robots} in a simulation, by calling tools. {HOW}"
    if others:
        heard = " You may talk to them with the tool say; what they say comes with your replies." if talk else ""
        text += f" Others direct {', '.join(others)}, one each; you see and command your own alone. {TOGETHER}{heard}"
    return text


def _phase(phase: dict[str, Any]) -> str:
    return f"{phase['number']} {phase['id']}: {phase['description']}"


def _listed(title: str, lines: list[str]) -> list[str]:
    return ["\n".join([title, *(f"* {line}" for line in lines)])] if lines else []


def _budget(budget: dict[str, Any]) -> str:
    left_s = budget.get("wall_clock_left_s")
    clock = f"{left_s:.0f} seconds to think in all" if left_s is not None else "as much time to think as you like"
    return (
        f"Budget: {budget['steps_left']} control steps of 20 ms, at most {budget['steps_per_command']} in one command; {clock}."
    )


def _brief(brief: dict[str, Any]) -> list[str]:
    told: list[str] = []
    for name, value in brief.items():
        if isinstance(value, str):
            told.append(value)
        elif isinstance(value, list):
            entries = [json.dumps(entry, separators=(",", ":"), ensure_ascii=False) for entry in listed(value)]
            told += ["\n".join([f"{name}:", *entries])] if entries else []
    return told
