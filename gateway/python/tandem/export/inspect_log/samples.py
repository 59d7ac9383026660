"""An episode as a sample of Inspect."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, cast

from inspect_ai.dataset import Sample
from inspect_ai.event import Event, SampleInitEvent, SampleLimitEvent, ScoreEvent
from inspect_ai.log import EvalError, EvalSample, EvalSampleLimit
from inspect_ai.model import ModelUsage
from inspect_ai.scorer import CORRECT, INCORRECT, Score

from ...agent.conversation import Ending, listed
from .episodes import Episode
from .transcript import SOURCE, Transcript

SUCCESS = "success"
"""Name of the score for the whole task; those of phases have their numbers, for example p1."""

_LIMITS: dict[Ending, tuple[str, str]] = {
    "token_limit": ("token", "tokens"),
    "price_limit": ("cost", "usd"),
    "call_limit": ("custom", "calls"),
    "time_limit": ("time", "seconds"),
}
"""Inspect's kinds of limits for the endings of models, and the names of the limits in the settings."""

_EPISODE_LIMITS = {
    "step_budget_exhausted": ("custom", "env_steps", "the episode's control steps ran out"),
    "wall_clock_exhausted": ("working", "thinking_s", "the episode's thinking time ran out"),
}
"""Inspect's kinds of limits for the ends of episodes, with the field of the result that has reached the limit."""

_METADATA = (
    "protocol",
    "assistance",
    "ended",
    "env_steps",
    "tool_calls",
    "requests",
    "thinking_s",
    "falls",
    "departures",
    "state_hash",
)
"""Fields of a result that become metadata."""


@dataclass(frozen=True)
class PlayedSample:
    """A sample with its usage and times."""

    sample: EvalSample
    started_at: datetime
    ended_at: datetime


def sample_of(episode: Episode, epoch: int) -> PlayedSample:
    """Returns the sample of an episode. Its messages are the conversations one after another, and each conversation's
    events are a span of its own.
    """
    transcripts = [Transcript(conversation) for conversation in episode.conversations]
    started_at = episode.begun_at
    ended_at = max(transcript.ended_at for transcript in transcripts)
    scores, limit = _scores(episode.result), _limit(episode)
    pairs = list(zip(episode.conversations, transcripts, strict=True))
    model_usage: dict[str, ModelUsage] = {}
    for conversation, transcript in pairs:
        model_usage[conversation.model] = model_usage.get(conversation.model, ModelUsage()) + transcript.usage
    role_usage = {conversation.robot: transcript.usage for conversation, transcript in pairs if conversation.robot is not None}
    if episode.source == "recording":
        model_usage, role_usage = {episode.conversations[0].model: _noted_usage(episode)}, {}
    sample = EvalSample(
        id=episode.seed,
        epoch=epoch,
        input=episode.instruction,
        target="",
        messages=[message for transcript in transcripts for message in transcript.messages],
        output=transcripts[0].output,
        scores=scores,
        metadata=_metadata(episode),
        events=_events(episode, transcripts, scores, limit),
        model_usage=model_usage,
        role_usage=role_usage,
        started_at=started_at.isoformat(),
        completed_at=ended_at.isoformat(),
        total_time=(ended_at - started_at).total_seconds(),
        working_time=max(transcript.seconds for transcript in transcripts),
        uuid=episode.folder.name,
        error=_error(episode),
        limit=limit,
    )
    return PlayedSample(sample, started_at, ended_at)


def _events(
    episode: Episode, transcripts: list[Transcript], scores: dict[str, Score], limit: EvalSampleLimit | None
) -> list[Event]:
    ended: dict[str, Any] = {
        "timestamp": max(transcript.ended_at for transcript in transcripts),
        "working_start": max(transcript.seconds for transcript in transcripts),
    }
    begun: dict[str, Any] = {"timestamp": episode.begun_at, "working_start": 0.0}
    inputs = Sample(input=episode.instruction, id=episode.seed, metadata=_metadata(episode))
    events: list[Event] = [SampleInitEvent(sample=inputs, **begun)]
    events += [event for transcript in transcripts for event in transcript.events]
    if limit is not None:
        kind = "custom" if limit.type == "context" else limit.type
        events.append(SampleLimitEvent(type=kind, message=limit.reason or "", limit=limit.limit, **ended))
    events += [ScoreEvent(score=score, scorer=name, **ended) for name, score in scores.items()]
    return events


def _scores(result: dict[str, Any]) -> dict[str, Score]:
    phases = cast("dict[str, float | None]", result["phases"])
    success = result["success"] if result.get("success") is not None else None not in phases.values()
    reached = {SUCCESS: Score(value=CORRECT if success else INCORRECT, explanation=f"the episode ended: {result['ended']}")}
    for number, time_s in phases.items():
        if time_s is None:
            reached[number] = Score(value=INCORRECT, explanation=f"{number} was not reached")
        else:
            told = f"{number} was reached at {time_s:.2f} s of the simulation"
            reached[number] = Score(value=CORRECT, explanation=told, metadata={"time_s": time_s})
    return reached


def _endings(episode: Episode) -> list[dict[str, Any]]:
    usage = cast("dict[str, Any]", episode.result.get("usage", {}))
    return listed(usage.get("endings"))


def _noted_usage(episode: Episode) -> ModelUsage:
    """Returns the usage that notes on an episode report."""
    usage = cast("dict[str, Any]", episode.result.get("usage", {}))
    read, cached, written = (usage.get(f"{name}_tokens", 0) for name in ("input", "cached", "output"))
    return ModelUsage(
        input_tokens=read - cached,
        output_tokens=written,
        total_tokens=read + written,
        input_tokens_cache_read=cached,
        total_cost=usage.get("usd"),
    )


def _limit(episode: Episode) -> EvalSampleLimit | None:
    """Returns the limit of a model, or else of the episode, that was reached first."""
    limits: dict[str | None, dict[str, Any]] = {each.robot: each.settings.get("limits", {}) for each in episode.conversations}
    for ending in _endings(episode):
        if ending["ending"] in _LIMITS:
            kind, name = _LIMITS[ending["ending"]]
            most = limits.get(ending.get("robot"), {}).get(name)
            return EvalSampleLimit.model_validate({"type": kind, "limit": most or 0, "reason": ending["text"]})
    if (ended := episode.result["ended"]) in _EPISODE_LIMITS:
        kind, field, reason = _EPISODE_LIMITS[ended]
        return EvalSampleLimit.model_validate({"type": kind, "limit": episode.result[field], "reason": reason})
    return None


def _error(episode: Episode) -> EvalError | None:
    """Returns the failure of an endpoint or of the simulator."""
    failures = [ending["text"] for ending in _endings(episode) if ending["ending"] in ("endpoint", "context")]
    if failure := episode.result.get("simulator_failure"):
        failures.append(f"the simulator failed {failure}")
    message = "; ".join(failures)
    return EvalError(message=message, traceback=message, traceback_ansi=message) if failures else None


def _metadata(episode: Episode) -> dict[str, Any]:
    fields = {name: episode.result[name] for name in _METADATA if episode.result.get(name) is not None}
    models = {conversation.robot or "all": conversation.settings for conversation in episode.conversations}
    return {**fields, "models": models, "endings": _endings(episode), "folder": str(episode.folder), SOURCE: episode.source}
