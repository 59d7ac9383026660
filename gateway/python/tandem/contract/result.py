"""Results of episodes.

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
"""End of a language model's play."""


@dataclass(frozen=True)
class ModelEnding:
    """End of a model's play, in its own words, too."""

    robot: str | None
    """The robot that it directed; left out where it directed all."""

    ending: AgentEnding
    """The end."""

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
class OperatorUse:
    """Requests and thinking time of a robot's operator up to its last command."""

    robot: str
    """The robot, for example "A"."""

    requests: int
    """Its operator's requests."""

    thinking_s: float
    """Wall clock that the operator has thought since its first request, while no step was made, in seconds."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> OperatorUse:
        """Reads what JSON has."""
        return OperatorUse(
            robot=value["robot"],
            requests=value["requests"],
            thinking_s=value["thinking_s"],
        )


@dataclass(frozen=True)
class ResultReply:
    """The reply to `finish`, and the content of `result.json`."""

    task: str
    """The task's id."""

    seed: int | None
    """The seed; left out for a policy whose assistance is "paper"."""

    protocol: Protocol
    """The rules that were in force."""

    phases: dict[str, float | None]
    """Times in simulated seconds at which phases were reached; null where one was not, or is not disclosed."""

    success: bool | None
    """True if every phase was reached; left out where phases are not disclosed, and in results of earlier
    versions.
    """

    ended: EndReason
    """Why the episode ended."""

    env_steps: int
    """Control steps of 20 ms, the initial hold included."""

    tool_calls: int
    """Calls of tools of all robots up to the end, reads, refused calls and the one that ended the episode
    included. Each command of a plan or walk is one, and each slice of 5 steps with `until`.
    """

    requests: int | None
    """Requests of the policy itself: like tool_calls, but a plan or a walk, whose commands are a call each, counts
    once. Left out in results of earlier versions.
    """

    thinking_s: float | None
    """Wall clock that the policy has thought between its calls, in seconds; where each robot has its own operator,
    that of all operators together.
    """

    operators: tuple[OperatorUse, ...]
    """Use by each operator that has commanded, where each robot has its own; left out otherwise."""

    falls: int
    """Robots that fell."""

    realtime_factor: float
    """Simulated seconds per second that the physics took."""

    state_hash: str | None
    """Hash of the whole physical state at the end, 16 hexadecimal digits; left out for a policy whose assistance
    is "paper".
    """

    simulator_failure: str | None
    """Failure of the simulator: its step, body and error; left out where it did not fail."""

    assistance: Assistance | None
    """Amount of information that the policy got."""

    extra_information: tuple[str, ...]
    """Information that the policy got beyond the benchmark's own policies, for example "depth_images"; left out
    where it was none.
    """

    extra_information_replies: dict[str, dict[str, int]]
    """Number of replies with each of it, by its name and by the robot it was of; left out where it was none, and
    of a short reply.
    """

    joints_clamped_share: float | None
    """Share of the joint targets that lay beyond the joints' limits by more than 0.01 rad, and were moved there;
    left out where none did.
    """

    departures: tuple[str, ...]
    """Departures from the benchmark, for example "assistance: full"; left out where there was none."""

    recording_failed: str | None
    """Why the recording is not complete; left out where it is."""

    usage: Usage | None
    """Usage that notes on the episode report; left out where there are none."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> ResultReply:
        """Reads what JSON has."""
        return ResultReply(
            task=value["task"],
            seed=value.get("seed"),
            protocol=value["protocol"],
            phases=value["phases"],
            success=value.get("success"),
            ended=value["ended"],
            env_steps=value["env_steps"],
            tool_calls=value["tool_calls"],
            requests=value.get("requests"),
            thinking_s=value.get("thinking_s"),
            operators=tuple(OperatorUse.of(item) for item in value.get("operators", ())),
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
class RobotUsage:
    """Usage of the model of one robot."""

    robot: str
    """The robot that it directed."""

    model: str | None
    """The model, as its latest note names it; left out where none does."""

    input_tokens: int
    """Tokens that it read, those from a cache included."""

    output_tokens: int
    """Tokens that it wrote."""

    cached_tokens: int
    """Number of read tokens that came from a cache."""

    usd: float | None
    """Cost in US dollars; left out where no note has it."""

    model_s: float | None
    """Seconds that it took; left out where no note has them."""

    @staticmethod
    def of(value: Mapping[str, Any]) -> RobotUsage:
        """Reads what JSON has."""
        return RobotUsage(
            robot=value["robot"],
            model=value.get("model"),
            input_tokens=value["input_tokens"],
            output_tokens=value["output_tokens"],
            cached_tokens=value["cached_tokens"],
            usd=value.get("usd"),
            model_s=value.get("model_s"),
        )


@dataclass(frozen=True)
class Usage:
    """Sum of the usage in all notes of an episode."""

    notes: int
    """Number of notes."""

    input_tokens: int
    """Tokens that models read, those from a cache included."""

    output_tokens: int
    """Tokens that models wrote."""

    cached_tokens: int
    """Number of read tokens that came from a cache."""

    usd: float | None
    """Cost in US dollars; left out where no note has it."""

    model_s: float | None
    """Seconds that models took; left out where no note has them."""

    models: tuple[str, ...]
    """The models that notes name."""

    robots: tuple[RobotUsage, ...]
    """Parts of the sums that belong to one robot, of notes that name it; left out where none does."""

    endings: tuple[ModelEnding, ...]
    """Ends of the models' play: one for all robots, or one for each that has reported it."""

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
            robots=tuple(RobotUsage.of(item) for item in value.get("robots", ())),
            endings=tuple(ModelEnding.of(item) for item in value.get("endings", ())),
        )
