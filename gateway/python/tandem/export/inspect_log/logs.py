"""Logs of Inspect, each with the episodes of one task and one set of models."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from os import PathLike
from pathlib import Path
from typing import Any

from inspect_ai.log import (
    EvalConfig,
    EvalDataset,
    EvalLog,
    EvalMetric,
    EvalPlan,
    EvalPlanStep,
    EvalResults,
    EvalScore,
    EvalSpec,
    EvalStats,
    write_eval_log,
)
from inspect_ai.model import ModelConfig, ModelUsage
from inspect_ai.scorer import CORRECT, Score

from ... import __version__
from .episodes import Conversation, Episode, episodes
from .samples import PlayedSample, sample_of
from .transcript import config_of

ID_LENGTH = 22
"""Length of Inspect's ids."""


@dataclass(frozen=True)
class WrittenLog:
    """A log that was written."""

    path: Path
    task: str
    model: str
    samples: int


def export_inspect(runs: str | PathLike[str], out: str | PathLike[str]) -> list[WrittenLog]:
    """Writes a log for each task and set of models. A log of the same episodes is replaced.

    runs: Folder of an episode, or a folder to search for episodes.
    out: Folder of the logs.
    """
    groups: dict[str, list[Episode]] = {}
    for episode in episodes(Path(runs)):
        groups.setdefault(_key(episode), []).append(episode)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    return [_write(folder, key, sorted(group, key=lambda each: (each.seed, each.begun_at))) for key, group in groups.items()]


def _key(episode: Episode) -> str:
    """Returns what the episodes of a log have in common."""
    result = episode.result
    models = [
        [each.robot, *(each.settings.get(name) for name in ("model", "api", "effort", "sampling"))]
        for each in episode.conversations
    ]
    return json.dumps([result["task"], result["protocol"], result.get("assistance"), episode.source, models])


def _write(folder: Path, key: str, group: Sequence[Episode]) -> WrittenLog:
    played: list[PlayedSample] = []
    seeds: Counter[int] = Counter()
    for episode in group:
        seeds[episode.seed] += 1
        played.append(sample_of(episode, seeds[episode.seed]))
    spec = _spec(key, group, played, max(seeds.values()))
    log = EvalLog(
        status="success",
        eval=spec,
        plan=EvalPlan(name="tandem", steps=[EvalPlanStep(solver="tandem_agent", params=spec.model_args)]),
        results=_results(played),
        stats=_stats(played),
        samples=[each.sample for each in played],
    )
    path = folder / f"{spec.created[:19].replace(':', '-')}+00-00_{spec.task}_{spec.task_id}.eval"
    write_eval_log(log, path)
    return WrittenLog(path, spec.task, spec.model, len(played))


def _spec(key: str, group: Sequence[Episode], played: Sequence[PlayedSample], epochs: int) -> EvalSpec:
    first = group[0]
    conversations = first.conversations
    names = list(dict.fromkeys(conversation.model for conversation in conversations))
    task, task_id = str(first.result["task"]), sha256(key.encode()).hexdigest()[:ID_LENGTH]
    limits: dict[str, Any] = conversations[0].settings.get("limits", {})
    roles: dict[str, ModelConfig | list[ModelConfig]] = {
        each.robot: _model(each) for each in conversations if each.robot is not None
    }
    return EvalSpec(
        created=min(each.started_at for each in played).isoformat(timespec="seconds"),
        eval_id=task_id,
        run_id=task_id,
        task=task,
        task_id=task_id,
        dataset=EvalDataset(name=task, samples=len({each.seed for each in group}), sample_ids=[each.seed for each in group]),
        model=" + ".join(names),
        model_generate_config=config_of(conversations[0].settings),
        model_base_url=conversations[0].settings.get("base_url"),
        model_args={each.robot or "all": each.settings for each in conversations},
        model_roles=roles or None,
        config=EvalConfig(epochs=epochs, token_limit=limits.get("tokens"), cost_limit=limits.get("usd")),
        packages={"tandem-sim": __version__},
        metadata={name: first.result.get(name) for name in ("protocol", "assistance", "departures")},
    )


def _model(conversation: Conversation) -> ModelConfig:
    settings = conversation.settings
    return ModelConfig(model=conversation.model, config=config_of(settings), base_url=settings.get("base_url"))


def _results(played: Sequence[PlayedSample]) -> EvalResults:
    scores: dict[str, list[Score]] = {}
    for each in played:
        for name, score in (each.sample.scores or {}).items():
            scores.setdefault(name, []).append(score)
    return EvalResults(
        total_samples=len(played),
        completed_samples=len(played),
        scores=[_score(name, values) for name, values in scores.items()],
    )


def _score(name: str, scores: Sequence[Score]) -> EvalScore:
    share = sum(score.value == CORRECT for score in scores) / len(scores)
    metrics = {"accuracy": share, "stderr": math.sqrt(share * (1 - share) / max(len(scores) - 1, 1))}
    return EvalScore(
        name=name,
        scorer=name,
        scored_samples=len(scores),
        unscored_samples=0,
        metrics={metric: EvalMetric(name=metric, value=value) for metric, value in metrics.items()},
    )


def _stats(played: Sequence[PlayedSample]) -> EvalStats:
    model_usage: dict[str, ModelUsage] = {}
    role_usage: dict[str, ModelUsage] = {}
    for each in played:
        for sums, usage in ((model_usage, each.sample.model_usage), (role_usage, each.sample.role_usage)):
            for name, more in usage.items():
                sums[name] = sums.get(name, ModelUsage()) + more
    return EvalStats(
        started_at=min(each.started_at for each in played).isoformat(timespec="seconds"),
        completed_at=max(each.ended_at for each in played).isoformat(timespec="seconds"),
        model_usage=model_usage,
        role_usage=role_usage,
    )
