"""Episodes that the agent joins or starts itself, with one model for all robots or one per robot."""

from __future__ import annotations

import sys
import threading
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unicodedata import category
from uuid import uuid4

from ..client import Client
from ..errors import Refused, TandemError
from .apis import open_model
from .conversation import listed
from .instructions import instructions
from .journal import Begun, EpisodeFile, Journal, LineFile, conversation_path, now, read_result
from .loop import Played, Player, Printer
from .seat import Seat
from .settings import AgentSettings, Team


@dataclass(frozen=True)
class Hosting:
    """Arguments of an episode to start."""

    task: str
    seed: int
    per_robot: bool = False
    talk: bool = False


@dataclass(frozen=True)
class Keeping:
    """Flags of a play and the folder where they are kept, so that the play can be resumed."""

    runs: Path | None
    """The server's folder of recordings. None: unknown, and nothing is kept."""

    flags: dict[str, Any]
    server_flags: dict[str, str]


def play_joined(client: Client, episode_id: str, robot: str | None, team: Team, folder: Path | None) -> Played:
    """Plays an episode that another program has started and will end.

    folder: Folder of this process for the conversation. None: it is not kept.
    """
    with ExitStack() as stack:
        lines = None if folder is None else stack.enter_context(closing(LineFile(conversation_path(folder, None))))
        journal = Journal(lines)
        seat = _take_seat(client, episode_id, robot, journal)
        return _play(seat, str(seat.briefing["status"]["task"]), team.of(robot), journal)


def play_own(url: str, hosting: Hosting, team: Team, keeping: Keeping) -> dict[str, Any]:
    """Starts an episode on a server, plays it, ends it, and returns its result."""
    host = Client(url)
    _check_robots(host, hosting, team)
    body: dict[str, Any] = {"task": hosting.task, "seed": hosting.seed}
    if hosting.per_robot:
        body |= {"operators": "per_robot", "talk": hosting.talk}
    start = host.request("POST", "/v1/episodes", body)
    episode_id = str(start["episode_id"])
    operators = tuple(listed(start.get("operators")))
    episode = EpisodeFile(episode_id, keeping.flags, keeping.server_flags, operators)
    with ExitStack() as stack:
        journals = _open_new(keeping.runs, episode, stack)
        print(f"{hosting.task}, seed {hosting.seed}: {episode_id} at {url}", flush=True)
        return _play_through(host, episode, team, journals)


def _check_robots(host: Client, hosting: Hosting, team: Team) -> None:
    """Refuses models of robots that the task does not have."""
    if team.robots and not hosting.per_robot:
        raise TandemError("--robot-model needs --per-robot, a model for each robot")
    robots = [each.robot for task in host.tasks().tasks if task.id == hosting.task for each in task.robots]
    unknown = [robot for robot in team.robots if robots and robot not in robots]
    if unknown:
        raise TandemError(f"{hosting.task} has no robot {unknown[0]!r} for --robot-model; have: {', '.join(robots)}")


def resume(url: str, folder: Path, episode: EpisodeFile, team: Team) -> dict[str, Any]:
    """Resumes an episode that an agent has left, unless it has ended, and returns its result."""
    host = Client(url)
    with ExitStack() as stack:
        # Journals that another process holds are refused before anything is done.
        journals = _open(folder, episode, stack)
        result = _ended(host, folder, episode)
        if result is None:
            print(f"{episode.flags['task']}, seed {episode.flags['seed']}: {episode.episode_id} at {url}", flush=True)
            return _play_through(host, episode, team, journals)
    print("the episode has ended already")
    _print_result(result)
    return result


def _ended(host: Client, folder: Path, episode: EpisodeFile) -> dict[str, Any] | None:
    """Returns the result of an episode that has ended; None while it goes on."""
    path = f"/v1/episodes/{episode.episode_id}"
    try:
        goes_on = host.request("GET", path)["ended"] is None
        return None if goes_on else host.request("DELETE", path)
    except Refused as refused:
        if refused.kind != "unknown-episode":
            raise
        result = read_result(folder)
        if result is None:
            raise TandemError(
                f"the server does not hold {episode.episode_id} any more, so that it cannot go on ({refused.detail}); "
                f"its recording is in {folder} (tandem recover makes it whole); play the task anew, without --resume"
            ) from refused
        return result


def _print_result(result: dict[str, Any]) -> None:
    """Prints the end of an episode in a line."""
    phases = ", ".join(f"{number} {_when(time_s)}" for number, time_s in result["phases"].items())
    print(
        f"{result['ended']}: {phases}; {result['env_steps']} steps, {result['tool_calls']} calls, {result['falls']} falls",
        flush=True,
    )


def _robots(episode: EpisodeFile) -> list[str | None]:
    """Returns the robot of each model; None for a model that controls all robots."""
    return [each["robot"] for each in episode.operators] or [None]


def _open_new(runs: Path | None, episode: EpisodeFile, stack: ExitStack) -> list[Journal]:
    """Writes the data for resuming an episode, and begins a journal for each model. On failure nothing is kept."""
    if runs is not None:
        folder = runs / episode.episode_id
        try:
            journals = _open(folder, episode, stack)
            episode.write(folder)
            return journals
        except (OSError, TandemError) as error:
            print(f"tandem agent: {error}; the play goes on, and --resume cannot take it up", file=sys.stderr)
    return [Journal() for _ in _robots(episode)]


def _open(folder: Path, episode: EpisodeFile, stack: ExitStack) -> list[Journal]:
    """Opens the journal of each model."""
    return [Journal(stack.enter_context(closing(LineFile(conversation_path(folder, robot))))) for robot in _robots(episode)]


def _play_through(host: Client, episode: EpisodeFile, team: Team, journals: Sequence[Journal]) -> dict[str, Any]:
    """Plays an episode to its end, ends it, and returns its result."""
    try:
        if episode.operators:
            _play_each(host.url, episode, team, journals)
        else:
            seat = _take_seat(host, episode.episode_id, None, journals[0])
            _play(seat, str(episode.flags["task"]), team.common, journals[0])
    finally:
        result = host.request("DELETE", f"/v1/episodes/{episode.episode_id}")
    _print_result(result)
    return result


def _take_seat(client: Client, episode_id: str, robot: str | None, journal: Journal) -> Seat:
    return Seat(client, episode_id, robot, None if journal.begun is None else journal.begun.tools)


def _play(seat: Seat, task: str, settings: AgentSettings, journal: Journal) -> Played:
    show = _printer(seat.robot)
    # Episodes of the same task begin with the same text.
    model = open_model(settings, f"tandem-{task}")
    begun = journal.begun
    if begun is None:
        begun = Begun(uuid4().hex, instructions(seat), seat.tools, settings=settings.told, at=now())
        journal.write(begun)
    played = Player(seat, model, settings, show, begun, journal).play()
    show(played.ledger.summary())
    return played


def _play_each(url: str, episode: EpisodeFile, team: Team, journals: Sequence[Journal]) -> None:
    """Plays with one model per robot in parallel. If one fails, the others play on, and the failure is raised at
    the end.
    """
    failures: list[BaseException] = []

    def operate(robot: str, token: str, journal: Journal) -> None:
        try:
            seat = _take_seat(Client(url, token=token), episode.episode_id, robot, journal)
            _play(seat, str(episode.flags["task"]), team.of(robot), journal)
        except BaseException as failure:
            failures.append(failure)

    threads = [
        threading.Thread(target=operate, args=(each["robot"], each["token"], journal), daemon=True)
        for each, journal in zip(episode.operators, journals, strict=True)
    ]
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
    """Makes a text safe for a terminal: a model's output cannot move the cursor or change colours."""
    return "".join(each if each in "\n\t" or category(each) != "Cc" else "\ufffd" for each in text)
