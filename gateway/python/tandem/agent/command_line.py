"""`python -m tandem.agent`: a model plays an episode. `tandem agent` and `--policy agent:` also start it."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import threading
from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, cast

from ..client import Client
from ..errors import TandemError
from ..server import serve
from .apis import open_model, without_keys
from .episodes import Hosting, Keeping, play_joined, play_own, resume
from .journal import EpisodeFile
from .settings import APIS, AgentSettings, Limits, Prices, Sampling, Team

DEFAULTS: dict[str, Any] = {
    "api": "openai",
    "context_tokens": 100_000,
    "max_calls": 500,
    # `tandem evaluate` stops a program after an hour; a model that takes this long finishes before.
    "max_seconds": 3300.0,
    "seed": 0,
    "assistance": "full",
    "per_robot": False,
    "talk": False,
    "robot_models": {},
}
"""Defaults for flags that neither the command line nor the resumed episode sets."""

MAY_CHANGE = (
    "base_url",
    "context_tokens",
    "max_tokens_total",
    "max_usd",
    "max_calls",
    "max_seconds",
    "usd_per_million_input",
    "usd_per_million_output",
    "usd_per_million_cached",
)
"""Flags that may change with --resume: the endpoint's address and the limits."""

SHARED = ("context_tokens", "max_tokens_total", "max_usd", "max_calls", "max_seconds")
"""Flags that also hold for a robot's own model, unless it has others."""

NOT_KEPT = ("resume", "runs", "url", "server_flags", "check")
"""Flags that do not affect the play."""

LOOPBACK = ("127.0.0.1", "localhost", "::1")

INTERRUPTED = 130
"""Exit status that shells report for a process that SIGINT has ended."""


def model_parser() -> argparse.ArgumentParser:
    """Returns the parser of the flags for one model, which are the same as in `tandem agent`."""
    flags = argparse.ArgumentParser(prog="--robot-model", add_help=False)
    model = flags.add_argument_group("the model")
    model.add_argument("--model", metavar="NAME", help="the model's name at its endpoint")
    model.add_argument(
        "--api",
        choices=APIS,
        help="what the endpoint speaks: OpenAI's Responses, its Chat Completions (Ollama, vLLM and most others), or "
        "Anthropic's Messages [default: openai]",
    )
    model.add_argument("--base-url", metavar="URL", help="where it is, as http://127.0.0.1:11434/v1 [default: the API's maker]")
    model.add_argument(
        "--effort", metavar="WORD", help="how much it thinks, in its API's words, as low or high [default: its own]"
    )
    model.add_argument(
        "--context-tokens",
        type=_count,
        metavar="N",
        help="longest conversation; the older half of a longer one becomes a list of calls [default: 100000]",
    )
    model.add_argument("--temperature", type=_amount, metavar="T", help="sampling temperature [default: the endpoint's]")
    model.add_argument("--top-p", type=_share, metavar="P", help="share of likely tokens [default: the endpoint's]")
    model.add_argument(
        "--sampling-seed", type=int, metavar="N", help="seed of the sampling, for openai-chat [default: the endpoint's]"
    )
    model.add_argument(
        "--extra-body",
        type=_object,
        metavar="JSON",
        help='further fields of requests, for example {"top_k": 40} [default: none]',
    )
    limits = flags.add_argument_group("limits, after which the episode is finished")
    limits.add_argument("--max-tokens-total", type=_count, metavar="N", help="tokens read and written [default: any number]")
    limits.add_argument("--max-usd", type=_amount, metavar="USD", help="US dollars, by the prices below [default: any amount]")
    limits.add_argument("--max-calls", type=_count, metavar="N", help="calls of tools [default: 500]")
    limits.add_argument("--max-seconds", type=_amount, metavar="SECONDS", help="time [default: 3300]")
    for name, what in (("input", "read"), ("output", "written"), ("cached", "read from a cache")):
        limits.add_argument(
            f"--usd-per-million-{name}", type=_amount, metavar="USD", help=f"price of a million tokens that are {what}"
        )
    return flags


def parser() -> argparse.ArgumentParser:
    """Returns the parser of all flags."""
    flags = argparse.ArgumentParser(
        prog="python -m tandem.agent",
        description="Have a language model play an episode: the one that TANDEM_URL and TANDEM_EPISODE name, or, with --task, "
        "a new one. Keys are read from the environment: OPENAI_API_KEY, ANTHROPIC_API_KEY.",
        parents=[model_parser()],
    )
    episode = flags.add_argument_group("a new episode")
    episode.add_argument("--task", metavar="TASK", help="what to play, as handover")
    episode.add_argument("--seed", type=int, metavar="N", help="decides where the objects stand [default: 0]")
    episode.add_argument("--url", metavar="URL", help="server that holds it [default: one in this process]")
    episode.add_argument("--runs", metavar="DIR", help="the server's folder of recordings [default: runs, without --url]")
    episode.add_argument(
        "--assistance", choices=("full", "paper"), help="what the model is told, without --url [default: full]"
    )
    episode.add_argument(
        "--per-robot",
        action="store_true",
        default=None,
        help="a model for each robot, which sees and commands that robot alone",
    )
    episode.add_argument(
        "--talk", action="store_true", default=None, help="with --per-robot: let them talk to each other by the tool say"
    )
    episode.add_argument(
        "--robot-model",
        dest="robot_models",
        action="append",
        type=_robot_model,
        metavar="ROBOT=MODEL",
        help="with --per-robot: one robot's model with its own flags, for example B=claude-opus-5-5?api=anthropic&max-usd=2",
    )
    flags.add_argument(
        "--resume",
        type=Path,
        metavar="FOLDER",
        help="in place of a new episode: go on with that of this folder, where its agent was killed; of the flags, limits, "
        "prices and the endpoint's address may be given anew, and all others are as before",
    )
    # Flags that `tandem agent` was given for its server.
    flags.add_argument("--server-flags", type=_object, default={}, help=argparse.SUPPRESS)
    flags.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    return flags


def settings_of(given: argparse.Namespace) -> AgentSettings:
    """Creates the agent's settings from the flags."""
    prices = (given.usd_per_million_input, given.usd_per_million_output)
    if prices[0] is None or prices[1] is None:
        if prices != (None, None) or given.usd_per_million_cached is not None:
            raise TandemError("prices are for --usd-per-million-input and --usd-per-million-output together")
        price = None
    else:
        price = Prices(prices[0], prices[1], given.usd_per_million_cached)
    limits = Limits(given.max_tokens_total, given.max_usd, given.max_calls, given.max_seconds)
    sampling = Sampling(given.temperature, given.top_p, given.sampling_seed, given.extra_body)
    return AgentSettings(given.model, given.api, given.base_url, given.effort, given.context_tokens, limits, price, sampling)


def team_of(flags: dict[str, Any]) -> Team:
    """Creates the settings of all models from the flags."""
    blank = dict.fromkeys(vars(model_parser().parse_args([])))
    shared = {name: flags[name] for name in SHARED}
    robots: dict[str, AgentSettings] = {}
    for robot, own in flags["robot_models"].items():
        try:
            robots[robot] = settings_of(argparse.Namespace(**{**blank, "api": DEFAULTS["api"], **shared, **own}))
        except TandemError as error:
            raise TandemError(f"--robot-model {robot}={own['model']}: {error}") from None
    return Team(settings_of(argparse.Namespace(**flags)), robots)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code: 1 if the model or the server gave no answer."""
    given = parser().parse_args(arguments)
    given.robot_models = dict(given.robot_models) if given.robot_models else None
    _keep_loopback_off_proxies()
    try:
        episode = None if given.resume is None else _resumed(given)
        flags = _flags(given) if episode is None else _changed(episode.flags, _given(given))
        team = team_of(flags)
        # Missing requirements are reported before an episode begins.
        for settings in (team.common, *team.robots.values()):
            open_model(settings, "")
        if given.check:
            return 0
        with _interruptible():
            return _run(given, flags, team) if episode is None else _resume(given, episode, team)
    except TandemError as error:
        print(f"tandem agent: {without_keys(str(error))}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("tandem agent: interrupted", file=sys.stderr)
        return INTERRUPTED


def _given(given: argparse.Namespace) -> dict[str, Any]:
    """Returns the given flags that affect the play."""
    return {name: value for name, value in vars(given).items() if value is not None and name not in NOT_KEPT}


def _flags(given: argparse.Namespace) -> dict[str, Any]:
    """Returns the flags of a new play with their values."""
    if given.model is None:
        raise TandemError("no model; give --model NAME, or --resume FOLDER to go on with an episode")
    return {**{name: value for name, value in vars(given).items() if name not in NOT_KEPT}, **DEFAULTS, **_given(given)}


def _changed(flags: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    """Returns the flags of an episode with those that are given anew."""
    models: dict[str, dict[str, Any]] = flags["robot_models"]
    anew = {robot: {**models[robot], **own} for robot, own in given.get("robot_models", {}).items()}
    return {**flags, **given, "robot_models": {**models, **anew}}


def _resumed(given: argparse.Namespace) -> EpisodeFile:
    """Reads the episode to resume. Refuses flags that would change it."""
    episode = EpisodeFile.read(given.resume)
    kept: dict[str, Any] = {**episode.flags, **episode.server_flags, "runs": str(given.resume.resolve().parent)}
    told = {**_given(given), **given.server_flags}
    if given.runs is not None:
        told["runs"] = str(Path(given.runs).resolve())
    models: dict[str, dict[str, Any]] = told.pop("robot_models", {})
    own = [(f" of {robot}'s model", anew, kept["robot_models"].get(robot, {})) for robot, anew in models.items()]
    differing = [
        f"--{name.replace('_', '-')}{whose} {value} (it was {_or_not_given(before.get(name))})"
        for whose, anew, before in [("", told, kept), *own]
        for name, value in anew.items()
        if name not in MAY_CHANGE and value != before.get(name)
    ]
    if differing:
        raise TandemError(f"{given.resume} was played otherwise: {', '.join(differing)}; leave out what differs")
    return episode


def _or_not_given(value: Any) -> str:
    return "not given" if value is None or value is False else str(value)


def _run(given: argparse.Namespace, flags: dict[str, Any], team: Team) -> int:
    if given.task is None:
        url, episode = os.environ.get("TANDEM_URL"), os.environ.get("TANDEM_EPISODE")
        if not url or not episode:
            raise TandemError("no episode; give --task, as handover, for a new one")
        start = os.environ.get("TANDEM_START")
        folder = None if start is None else Path(start).parent
        play_joined(Client(url), episode, os.environ.get("TANDEM_ROBOT"), team, folder)
        return 0
    with ExitStack() as stack:
        url, runs = given.url, given.runs
        if url is None:
            runs = runs or "runs"
            url = stack.enter_context(serve(runs=runs, assistance=flags["assistance"])).url
        hosting = Hosting(flags["task"], flags["seed"], flags["per_robot"], flags["talk"])
        keeping = Keeping(None if runs is None else Path(runs), flags, given.server_flags)
        play_own(url, hosting, team, keeping)
    return 0


def _resume(given: argparse.Namespace, episode: EpisodeFile, team: Team) -> int:
    folder = given.resume.resolve()
    with ExitStack() as stack:
        url = given.url
        if url is None:
            url = stack.enter_context(serve(runs=folder.parent, assistance=episode.flags["assistance"])).url
        resume(url, folder, episode, team)
    return 0


def _keep_loopback_off_proxies() -> None:
    """Makes the SDKs reach endpoints on this machine directly, without a proxy."""
    known = os.environ.get("no_proxy") or os.environ.get("NO_PROXY") or ""
    hosts = [*filter(None, (host.strip() for host in known.split(","))), *LOOPBACK]
    for name in ("NO_PROXY", "no_proxy"):
        os.environ[name] = ",".join(dict.fromkeys(hosts))


@contextmanager
def _interruptible() -> Generator[None, None, None]:
    """Turns the first SIGINT or SIGTERM into KeyboardInterrupt, so that episodes are ended. Ignores further ones."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        for each in signals:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt

    signals = (signal.SIGINT, signal.SIGTERM)
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = [signal.signal(each, interrupt) for each in signals]
    try:
        yield
    finally:
        for each, handler in zip(signals, before, strict=True):
            signal.signal(each, handler)


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError("give a whole number from 1 up")
    return value


def _share(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 1:
        raise argparse.ArgumentTypeError("give a number from 0 to 1")
    return value


def _robot_model(text: str) -> tuple[str, dict[str, Any]]:
    robot, _, model = text.partition("=")
    name, _, options = model.partition("?")
    if not robot or not name or "?" in robot:
        raise argparse.ArgumentTypeError("give a robot and its model, for example B=MODEL or B=MODEL?api=anthropic&max-usd=2")
    words = [f"--{option}" for option in options.split("&") if option]
    given = vars(model_parser().parse_args([f"--model={name}", *words]))
    return robot, {flag: value for flag, value in given.items() if value is not None}


def _object(text: str) -> dict[str, Any]:
    try:
        value: Any = json.loads(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f'no JSON ({error}); give an object, for example {{"top_k": 40}}') from error
    if not isinstance(value, dict):
        raise argparse.ArgumentTypeError('give a JSON object, for example {"top_k": 40}')
    return cast("dict[str, Any]", value)


def _amount(text: str) -> float:
    value = float(text)
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError("give a number from 0 up")
    return value
