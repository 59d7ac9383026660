"""`python -m tandem.baselines`: trains or serves a policy, or runs the whole recipe of a task."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import get_args

from ..errors import TandemError
from ..export.settings import library
from .data import task_of
from .maps import MAP_FILE
from .recipe import Recipe, execute_rows, run_recipe, training_steps
from .settings import PolicyKind, Scope, Sharing, TrainingSettings

INTERRUPTED = 130
"""Exit status that shells report for a process that SIGINT has ended."""


def parser() -> argparse.ArgumentParser:
    """Returns the parser of the flags."""
    flags = argparse.ArgumentParser(prog="python -m tandem.baselines", description="Policies that learn from demonstrations.")
    commands = flags.add_subparsers(dest="command", required=True)
    train = commands.add_parser("train", help="train a policy from a data set; a run that was stopped goes on")
    train.add_argument("data_set", metavar="DATA", help="folder that tandem export lerobot wrote")
    train.add_argument("out", metavar="POLICY", help="folder of the policy")
    _add_settings(train)
    train.add_argument("--threads", type=int, metavar="N", help="of PyTorch")
    train.add_argument("--device", default="cpu", help="where PyTorch computes, as cuda [default: cpu]")
    serve = commands.add_parser("serve", help="serve a policy to tandem evaluate")
    serve.add_argument("policy", metavar="POLICY", help="folder of the policy")
    serve.add_argument("--host", default="127.0.0.1")
    serve.add_argument("--port", type=int, default=8001)
    serve.add_argument("--threads", type=int, default=1, metavar="N", help="of PyTorch [default: 1]")
    recipe = commands.add_parser("recipe", help="demonstrations, data set, policy, evaluations and report of a task")
    recipe.add_argument("task", metavar="TASK")
    recipe.add_argument("--out", metavar="DIR", help="folder for all of it [default: runs/baselines/TASK]")
    defaults = Recipe()
    recipe.add_argument("--demonstrations", default=defaults.demonstrations, metavar="SEEDS", help="[default: %(default)s]")
    recipe.add_argument("--seeds", default=defaults.seeds, metavar="SEEDS", help="of the evaluations [default: %(default)s]")
    recipe.add_argument("--jobs", type=int, metavar="N", help="worlds side by side, and threads [default: the machine's cores]")
    _add_settings(recipe)
    return flags


def _add_settings(command: argparse.ArgumentParser) -> None:
    defaults = TrainingSettings()
    for name, values in (("kind", PolicyKind), ("scope", Scope), ("sharing", Sharing)):
        command.add_argument(
            f"--{name}", choices=get_args(values), default=getattr(defaults, name), help="[default: %(default)s]"
        )
    for name in ("batch", "chunk_rows", "every", "hidden", "seed"):
        flag, default = "--" + name.replace("_", "-"), getattr(defaults, name)
        command.add_argument(flag, type=int, default=default, metavar="N", help="[default: %(default)s]")
    command.add_argument("--steps", type=int, metavar="N", help="of training [default: as the task asks for]")
    command.add_argument("--execute-rows", type=int, metavar="N", help="of an answer's rows [default: as the task asks for]")


def _settings(given: argparse.Namespace, task: str) -> TrainingSettings:
    chosen = {field.name: getattr(given, field.name) for field in fields(TrainingSettings) if hasattr(given, field.name)}
    if chosen["steps"] is None:
        chosen["steps"] = training_steps(task)
    if chosen["execute_rows"] is None:
        chosen["execute_rows"] = min(execute_rows(task), chosen["chunk_rows"])
    return TrainingSettings(**chosen)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code."""
    given = parser().parse_args(arguments)
    # Waiting threads of PyTorch release their core to other work, such as the worlds of an evaluation.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    try:
        library("torch", "policies are trained and played by PyTorch", "baselines")
        {"train": _train, "serve": _serve, "recipe": _recipe}[given.command](given)
        return 0
    except TandemError as error:
        print(f"tandem.baselines: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("tandem.baselines: interrupted; the same command goes on", file=sys.stderr)
        return INTERRUPTED


def _tell(line: str) -> None:
    print(line, flush=True)


def _train(given: argparse.Namespace) -> None:
    from .training import train

    settings = _settings(given, task_of(Path(given.data_set)))
    train(given.data_set, given.out, settings, threads=given.threads, device=given.device, tell=_tell)


def _recipe(given: argparse.Namespace) -> None:
    recipe = Recipe(given.demonstrations, given.seeds, given.jobs)
    out = Path(given.out or f"runs/baselines/{given.task}")
    _tell(f"all is told in {run_recipe(given.task, out, _settings(given, given.task), recipe, tell=_tell)}")


def _serve(given: argparse.Namespace) -> None:
    from .policy import load

    policy = load(given.policy, given.threads)
    with policy.serve(given.host, given.port) as server:
        map_file = Path(given.policy) / MAP_FILE
        print(
            f"tandem evaluate --policy {server.url} --policy-map {map_file} --protocol benchmark --tasks {policy.task}",
            flush=True,
        )
        server.wait()
