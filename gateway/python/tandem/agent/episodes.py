"""Episodes that are joined, and episodes of one's own: one model for all robots, or one for each."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any
from unicodedata import category

from ..client import Client
from .apis import open_model
from .conversation import listed
from .loop import Played, Player, Printer
from .seat import Seat
from .settings import AgentSettings


@dataclass(frozen=True)
class Hosting:
    """An episode to begin."""

    task: str
    seed: int
    per_robot: bool = False
    talk: bool = False


def play_joined(client: Client, episode_id: str, robot: str | None, settings: AgentSettings) -> Played:
    """Plays an episode that somebody else has begun and ends."""
    return _play(Seat(client, episode_id, robot), settings, _printer(robot))


def play_own(url: str, hosting: Hosting, settings: AgentSettings) -> dict[str, Any]:
    """Begins an episode on a server, plays it, ends it, and returns its result."""
    host = Client(url)
    body: dict[str, Any] = {"task": hosting.task, "seed": hosting.seed}
    if hosting.per_robot:
        body |= {"operators": "per_robot", "talk": hosting.talk}
    start = host.request("POST", "/v1/episodes", body)
    episode_id = str(start["episode_id"])
    print(f"{hosting.task}, seed {hosting.seed}: {episode_id} at {url}", flush=True)
    try:
        operators = listed(start.get("operators"))
        if operators:
            _play_each(url, episode_id, operators, settings)
        else:
            _play(Seat(host, episode_id), settings, _printer(None))
    finally:
        result = host.request("DELETE", f"/v1/episodes/{episode_id}")
    phases = ", ".join(f"{number} {_when(time_s)}" for number, time_s in result["phases"].items())
    print(
        f"{result['ended']}: {phases}; {result['env_steps']} steps, {result['tool_calls']} calls, {result['falls']} falls",
        flush=True,
    )
    return result


def _play(seat: Seat, settings: AgentSettings, show: Printer) -> Played:
    # Episodes of one task begin alike.
    model = open_model(settings, f"tandem-{seat.briefing['status']['task']}")
    played = Player(seat, model, settings, show).play()
    show(played.ledger.summary())
    return played


def _play_each(url: str, episode_id: str, operators: list[dict[str, str]], settings: AgentSettings) -> None:
    """One model for each robot, side by side. Where one fails the others play on, and the failure is raised at the end."""
    failures: list[BaseException] = []

    def operate(robot: str, token: str) -> None:
        try:
            _play(Seat(Client(url, token=token), episode_id, robot), settings, _printer(robot))
        except BaseException as failure:
            failures.append(failure)

    threads = [threading.Thread(target=operate, args=(each["robot"], each["token"]), daemon=True) for each in operators]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]


def _when(time_s: float | None) -> str:
    return "not reached" if time_s is None else f"at {time_s:.2f} s"


def _printer(robot: str | None) -> Printer:
    prefix = "" if robot is None else f"{robot}: "

    def show(text: str) -> None:
        print(f"{prefix}{printable(text)}", flush=True)

    return show


def printable(text: str) -> str:
    """A text as a terminal may show it: what a model writes cannot move its cursor or change its colours."""
    return "".join(each if each in "\n\t" or category(each) != "Cc" else "\ufffd" for each in text)
