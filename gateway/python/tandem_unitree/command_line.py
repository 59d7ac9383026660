"""The command line of `python -m tandem_unitree`."""

from __future__ import annotations

import argparse
import importlib.util
import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tandem import TandemError

from .link import Access, Link
from .robot.remarks import log_to_stderr
from .robot.shared import RobotSettings

ROBOTS = {
    "A": RobotSettings("A", 1, address="127.0.0.2"),
    "B": RobotSettings("B", 2, address="127.0.0.3"),
    "C": RobotSettings("C", 3, address="127.0.0.4"),
}
"""Domains and addresses of robots by default."""


def _pairs(text: str) -> dict[str, str]:
    """Reads `A=0,B=5`."""
    pairs: dict[str, str] = {}
    for pair in text.split(","):
        robot, _, value = pair.partition("=")
        pairs[robot] = value
    unknown = [robot for robot, value in pairs.items() if robot not in ROBOTS or not value]
    if unknown:
        raise argparse.ArgumentTypeError(f"give robots with their values, for example A=0,B=5; not {text!r}")
    return pairs


def _domains(text: str) -> dict[str, int]:
    try:
        return {robot: int(value) for robot, value in _pairs(text).items()}
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"domains are whole numbers, for example A=0; not {text!r}") from error


def _names(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    if not set(names) <= set(ROBOTS):
        raise argparse.ArgumentTypeError(f"robots are called {', '.join(ROBOTS)}; not {text!r}")
    return names


def parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    own = argparse.ArgumentParser(
        prog="python -m tandem_unitree", description="Serves the robots of an episode as Unitree G1s."
    )
    what = own.add_argument_group("what is played")
    what.add_argument("--task", help="task of an episode to start, for example handover")
    what.add_argument("--seed", type=int, default=0, help="seed of the (first) episode; default 0")
    what.add_argument("--episodes", type=int, default=1, help="episodes to play, with the seeds that follow; default 1")
    what.add_argument("--protocol", choices=("agentic", "benchmark"), default="agentic", help="rules; default agentic")
    what.add_argument("--robots", type=_names, default=tuple(ROBOTS), help="robots to serve, for example A,B; default all")
    what.add_argument("--experts", type=_names, default=(), help="robots that the task's expert drives, for example B")
    what.add_argument("--runs", type=Path, default=Path("runs"), help="folder of recordings; default runs")
    what.add_argument("--server", help="URL of a server to play on; without it one is started")
    what.add_argument("--token", help="an operator's token, or with --task the server's; also read from TANDEM_TOKEN")
    how = own.add_argument_group("how robots are reached")
    how.add_argument("--domains", type=_domains, default={}, help="DDS domains, for example A=0; default A=1,B=2,C=3")
    how.add_argument("--interface", default="lo", help="network interface of the DDS topics; default lo")
    how.add_argument(
        "--addresses", type=_pairs, default={}, help="addresses of ZMQ sockets; default A=127.0.0.2,B=127.0.0.3,C=127.0.0.4"
    )
    how.add_argument("--clock", choices=("real", "hold"), default="real", help="whether time passes while no program commands")
    how.add_argument(
        "--released", action="store_true", help="begin with the mode released, so that rt/lowcmd moves joints at once"
    )
    how.add_argument(
        "--joint-control",
        action="store_true",
        help="let rt/lowcmd drive every motor by q, dq, kp, kd and tau, legs included; the program balances the robot",
    )
    how.add_argument("--camera-fps", type=float, default=15.0, help="pictures a second while a client watches; default 15")
    how.add_argument("--verbose", action="store_true", help="log every service call")
    return own


def _robots(given: argparse.Namespace) -> list[RobotSettings]:
    """Returns how each robot is reached."""
    settings: list[RobotSettings] = []
    for robot, usual in ROBOTS.items():
        settings.append(
            replace(
                usual,
                domain=given.domains.get(robot, usual.domain),
                address=given.addresses.get(robot, usual.address),
                interface=given.interface,
                clock=given.clock,
                released=given.released,
                joint_control=given.joint_control,
                camera_fps=given.camera_fps,
            )
        )
    return settings


def _join(given: argparse.Namespace, token: str) -> int:
    """Joins an episode as the operator of one robot, in this process."""
    from .adapter import Adapter

    access = Access(given.server, token)
    link = Link(access)
    settings = {one.robot: one for one in _robots(given)}[link.robot]
    link.close()

    def no_access(wait_s: float) -> Access | None:
        raise EOFError

    Adapter(settings, access, no_access).run()
    return 0


def _check_extra() -> None:
    """Checks that the packages of the wheel's extra are there."""
    missing = [name for name in ("cyclonedds", "zmq", "PIL") if importlib.util.find_spec(name) is None]
    if missing:
        extra = 'pip install "tandem-sim[unitree]", by Python 3.10 where cyclonedds 0.10 has no other wheel'
        raise TandemError(f"the extra `unitree` is not installed ({', '.join(missing)} is missing): {extra}")


def _interrupt(_signal: int, _frame: object) -> None:
    raise KeyboardInterrupt


def command_line(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit status."""
    own = parser()
    given = own.parse_args(arguments)
    log_to_stderr(verbose=given.verbose)
    signal.signal(signal.SIGTERM, _interrupt)
    token = given.token or (os.environ.get("TANDEM_TOKEN") if given.task is None else None)
    try:
        _check_extra()
        if given.task is None:
            if given.server is None or token is None:
                own.error("give --task to start an episode, or --server and --token to join one")
            return _join(given, token)
        from .team import EpisodeSettings, play

        settings = EpisodeSettings(
            task=given.task,
            seed=given.seed,
            protocol=given.protocol,
            episodes=given.episodes,
            experts=given.experts,
            server=given.server,
            token=given.token,
            runs=given.runs,
        )
        play(settings, [robot for robot in _robots(given) if robot.robot in given.robots])
    except KeyboardInterrupt:
        return 130
    except TandemError as error:
        print(error, file=sys.stderr)
        return 1
    return 0
