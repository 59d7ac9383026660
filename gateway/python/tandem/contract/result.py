"""What an episode came to.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from .replies import Assistance, EndReason, Protocol

AgentEnding: TypeAlias = Literal[
    "success",
    "finished",
    "refused",
    "content_filter",
    "silent",
    "token_limit",
    "price_limit",
    "call_limit",
    "time_limit",
    "context",
    "endpoint",
]
"""How the play of a language model ended."""


@dataclass(frozen=True)
class ModelEnding:
    """How a model's play ended, and its own words for it."""

    robot: str | None
    """The robot that it directed; left out where it directed all."""

    ending: AgentEnding
    """How it ended."""

    text: str
    """The words of the model or of its endpoint, as of a refusal; empty where there are none."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> ModelEnding:
        """Reads what JSON has."""
        return ModelEnding(
            robot=value.get("robot"),
            ending=value["ending"],
            text=value["text"],
        )


@dataclass(frozen=True)
class ResultReply:
    """The reply to `finish`, and the content of `result.json`."""

    task: str
    """The task's id."""

    seed: int | None
    """The seed; left out where it is told to a policy whose assistance is "paper"."""

    protocol: Protocol
    """The rules that were in force."""

    phases: dict[str, float | None]
    """When each phase was reached, in simulated seconds; null where it was not, or is not told."""

    ended: EndReason
    """Why the episode ended."""

    env_steps: int
    """Control steps of 20 ms, the initial hold included."""

    tool_calls: int
    """Calls of tools up to the end, reads, refused calls and the one that ended the episode included."""

    requests: int | None
    """As tool_calls, but with one for a plan or a walk, whose commands are a call each: what the policy asked for
    itself. Left out in results of earlier versions.
    """

    thinking_s: float | None
    """Wall clock that the policy has thought between its calls, in seconds."""

    falls: int
    """Robots that fell."""

    realtime_factor: float
    """Simulated seconds per second that the physics took."""

    state_hash: str | None
    """Hash of the whole physical state at the end, 16 hexadecimal digits; left out where it is told to a policy
    whose assistance is "paper".
    """

    simulator_failure: str | None
    """How the simulator failed: in which step, at which body, and what came out; left out where it did not."""

    assistance: Assistance | None
    """How much the policy was told."""

    extra_information: tuple[str, ...]
    """What the policy was shown beyond what the benchmark's own policies see, as "depth_images"; left out where it
    was nothing.
    """

    extra_information_replies: dict[str, dict[str, int]]
    """How many replies showed it, by what it was, then by the robot that it was of; left out where it was nothing."""

    joints_clamped_share: float | None
    """Share of the joint targets that lay beyond the joints' limits by more than 0.01 rad, and were moved there;
    left out where none did.
    """

    departures: tuple[str, ...]
    """What was not as the benchmark has it, as "assistance: full"; left out where it was nothing."""

    recording_failed: str | None
    """Why the recording is not complete; left out where it is."""

    usage: Usage | None
    """What notes on the episode say that was used; left out where there are none."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> ResultReply:
        """Reads what JSON has."""
        return ResultReply(
            task=value["task"],
            seed=value.get("seed"),
            protocol=value["protocol"],
            phases=value["phases"],
            ended=value["ended"],
            env_steps=value["env_steps"],
            tool_calls=value["tool_calls"],
            requests=value.get("requests"),
            thinking_s=value.get("thinking_s"),
            falls=value["falls"],
            realtime_factor=value["realtime_factor"],
            state_hash=value.get("state_hash"),
            simulator_failure=value.get("simulator_failure"),
            assistance=value.get("assistance"),
            extra_information=tuple(value.get("extra_information", ())),
            extra_information_replies=value.get("extra_information_replies", {}),
            joints_clamped_share=value.get("joints_clamped_share"),
            departures=tuple(value.get("departures", ())),
            recording_failed=value.get("recording_failed"),
            usage=None if (got := value.get("usage")) is None else Usage.of(got),
        )


@dataclass(frozen=True)
class Usage:
    """What all notes of an episode say that was used, added up."""

    notes: int
    """How many notes there are."""

    input_tokens: int
    """Tokens that models read, those from a cache included."""

    output_tokens: int
    """Tokens that models wrote."""

    cached_tokens: int
    """Of those that they read, how many came from a cache."""

    usd: float | None
    """What it cost in US dollars; left out where no note says it."""

    model_s: float | None
    """How long models took, in seconds; left out where no note says it."""

    models: tuple[str, ...]
    """The models that notes name."""

    endings: tuple[ModelEnding, ...]
    """How the play of the models ended: one for all robots, or one for each that has said so."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> Usage:
        """Reads what JSON has."""
        return Usage(
            notes=value["notes"],
            input_tokens=value["input_tokens"],
            output_tokens=value["output_tokens"],
            cached_tokens=value["cached_tokens"],
            usd=value.get("usd"),
            model_s=value.get("model_s"),
            models=tuple(value.get("models", ())),
            endings=tuple(ModelEnding.of(item) for item in value.get("endings", ())),
        )
