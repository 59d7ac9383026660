"""Starts episodes, and a process for each robot."""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from tandem import Client, TandemError, serve
from tandem.contract.replies import Protocol

from .adapter import serve_robot
from .link import Access
from .robot.remarks import LOG
from .robot.shared import RobotSettings

PATIENCE_S = 0.2
"""Time for which robots wait for one whose process does not command; then it is held still until it commands again."""

POLL_S = 0.25
"""Period at which the end of an episode is looked for."""


@dataclass(frozen=True)
class EpisodeSettings:
    """The episodes to play."""

    task: str
    seed: int = 0
    protocol: Protocol = "agentic"
    episodes: int = 1
    """Episodes to play, one after another, with seeds that follow `seed`."""

    experts: tuple[str, ...] = ()
    """Robots that the task's expert drives."""

    server: str | None = None
    """Server to play on; `None` starts one."""

    token: str | None = None
    """Token of that server, if it wants one."""

    runs: Path = Path("runs")
    """Folder of the recordings of a server that is started."""


@dataclass
class _Worker:
    """The process of one robot."""

    robot: str
    process: BaseProcess
    connection: Connection


@contextmanager
def _server(settings: EpisodeSettings) -> Generator[str]:
    """Gives the URL of the server to play on."""
    if settings.server is not None:
        yield settings.server
        return
    with serve(runs=settings.runs) as server:
        LOG.info("server at %s, recordings in %s", server.url, settings.runs)
        yield server.url


def play(settings: EpisodeSettings, robots: Sequence[RobotSettings]) -> list[dict[str, Any]]:
    """Plays episodes, each robot in a process of its own, and returns their results.

    robots: Interfaces of each robot; those that the task does not have, and those of the expert, are left out.
    """
    workers: list[_Worker] = []
    results: list[dict[str, Any]] = []
    with _server(settings) as url:
        client = Client(url, token=settings.token)
        try:
            for seed in range(settings.seed, settings.seed + settings.episodes):
                results.append(_play_one(client, url, settings, seed, robots, workers))
        finally:
            _stop(workers)
    return results


def _play_one(
    client: Client, url: str, settings: EpisodeSettings, seed: int, robots: Sequence[RobotSettings], workers: list[_Worker]
) -> dict[str, Any]:
    """Plays one episode to its end, or until the processes have ended or the user interrupts, and returns its result."""
    body = {"task": settings.task, "seed": seed, "protocol": settings.protocol}
    started = client.request("POST", "/v1/episodes", {**body, "operators": "per_robot", "patience_s": PATIENCE_S})
    path = f"/v1/episodes/{started['episode_id']}"
    tokens = {operator["robot"]: str(operator["token"]) for operator in started["operators"]}
    interrupted = False
    try:
        served = [robot for robot in robots if robot.robot in tokens and robot.robot not in settings.experts]
        _give_access(url, tokens, served, workers)
        for robot in settings.experts:
            client.request("POST", "/operate/expert", {"episode": started["episode_id"], "robot": robot})
        _say_free(url, tokens, {worker.robot for worker in workers} | set(settings.experts))
        while client.request("GET", path)["ended"] is None and any(worker.process.is_alive() for worker in workers):
            time.sleep(POLL_S)
    except KeyboardInterrupt:
        interrupted = True
    result: dict[str, Any] = client.request("DELETE", path)
    LOG.info("result: %s", json.dumps(result))
    if interrupted:
        raise KeyboardInterrupt
    if not any(worker.process.is_alive() for worker in workers):
        raise TandemError("no robot is served any more; the log says why")
    return result


def _give_access(url: str, tokens: dict[str, str], robots: Sequence[RobotSettings], workers: list[_Worker]) -> None:
    """Gives each robot's process access to an episode, and starts the processes before the first one."""
    if not workers:
        context = multiprocessing.get_context("spawn")
        last_message = context.Value("d", 0.0, lock=False)
        for robot in robots:
            ours, theirs = context.Pipe()
            process = context.Process(target=serve_robot, args=(robot, theirs, last_message), name=f"robot {robot.robot}")
            process.start()
            theirs.close()
            workers.append(_Worker(robot.robot, process, ours))
    if not workers:
        raise TandemError("no robot is left to be driven; name some with --robots")
    for worker in workers:
        worker.connection.send(Access(url, tokens[worker.robot]))


def _say_free(url: str, tokens: dict[str, str], driven: set[str]) -> None:
    """Logs the tokens of robots that nobody drives."""
    for robot, token in tokens.items():
        if robot not in driven:
            LOG.info("robot %s stands still until its operator calls: %s, token %s", robot, url, token)


def _stop(workers: Sequence[_Worker]) -> None:
    """Ends the processes, which end themselves when their connection closes."""
    for worker in workers:
        worker.connection.close()
    for worker in workers:
        worker.process.join(5.0)
        if worker.process.is_alive():
            worker.process.terminate()
