"""Results of episodes.

Written by the tests of `tools_spec` from the one list of tools; not to be edited.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from .reading import Reply
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


@dataclass(frozen=True, kw_only=True)
class ModelEnding(Reply):
    """End of a model's play, with its own text."""

    robot: str | None = None
    """The robot that it directed; left out where it directed all."""

    ending: AgentEnding
    """The end."""

    text: str
    """Text of the model or its endpoint, for example a refusal; empty where there is none."""


@dataclass(frozen=True, kw_only=True)
class OperatorUse(Reply):
    """Requests and thinking time of a robot's operator up to its last command."""

    robot: str
    """The robot, for example "A"."""

    requests: int
    """Its operator's requests."""

    thinking_s: float
    """Wall-clock thinking time of the operator since its first request, without steps, in seconds."""


@dataclass(frozen=True, kw_only=True)
class ResultReply(Reply):
    """The reply to `finish`, and the content of `result.json`."""

    task: str
    """The task's id."""

    seed: int | None = None
    """The seed; left out for a policy whose assistance is "paper"."""

    protocol: Protocol
    """The rules that were in force."""

    phases: dict[str, float | None]
    """Simulated seconds at which phases were reached; null for one not reached or not disclosed."""

    success: bool | None = None
    """True if every phase was reached; left out where phases are not disclosed, and in results of earlier
    versions.
    """

    ended: EndReason
    """Cause of its end."""

    env_steps: int
    """Control steps of 20 ms, the initial hold included."""

    tool_calls: int
    """Tool calls of all robots, including reads, refused calls and the one that ended the episode. Each command of
    a plan or walk counts as one, and each slice of 5 steps with `until`.
    """

    requests: int | None = None
    """Requests of the policy itself: like tool_calls, but a plan or a walk, whose commands are a call each, counts
    once. Left out in results of earlier versions.
    """

    thinking_s: float | None = None
    """Wall-clock thinking time of the policy between its calls, in seconds; with one operator per robot, the sum
    over all operators.
    """

    operators: tuple[OperatorUse, ...] = ()
    """Use by each operator that has commanded, where each robot has its own; left out otherwise."""

    falls: int
    """Robots that fell."""

    realtime_factor: float
    """Ratio of simulated time to physics wall clock."""

    state_hash: str | None = None
    """Hash of the whole physical state at the end, 16 hexadecimal digits; left out for a policy whose assistance
    is "paper".
    """

    simulator_failure: str | None = None
    """Failure of the simulator: its step, body and error; left out where it did not fail."""

    assistance: Assistance | None = None
    """Amount of information that the policy got."""

    extra_information: tuple[str, ...] = ()
    """Information that the policy got and the benchmark withholds, for example "depth_images"; left out where
    there was none.
    """

    extra_information_replies: dict[str, dict[str, int]] = field(default_factory=dict[str, dict[str, int]])
    """Number of replies with each kind, by its name and robot; left out where there was none, and of a short
    reply.
    """

    joints_clamped_share: float | None = None
    """Share of the joint targets that exceeded joint limits by more than 0.01 rad and were clamped; left out where
    none did.
    """

    departures: tuple[str, ...] = ()
    """Departures from the benchmark, for example "assistance: full"; left out where there was none."""

    recording_failed: str | None = None
    """Cause of an incomplete recording; left out otherwise."""

    usage: Usage | None = None
    """Usage that notes on the episode report; left out where there are none."""


@dataclass(frozen=True, kw_only=True)
class RobotUsage(Reply):
    """Usage of one robot's model."""

    robot: str
    """The robot that it directed."""

    model: str | None = None
    """The model, as its latest note names it; left out where none does."""

    input_tokens: int
    """Input tokens, including cached ones."""

    output_tokens: int
    """Output tokens."""

    cached_tokens: int
    """Number of input tokens from a cache."""

    usd: float | None = None
    """Cost in US dollars; left out where no note has it."""

    model_s: float | None = None
    """Seconds that it took; left out where no note has them."""


@dataclass(frozen=True, kw_only=True)
class Usage(Reply):
    """Sum of the usage in all notes of an episode."""

    notes: int
    """Number of notes."""

    input_tokens: int
    """Input tokens of models, including cached ones."""

    output_tokens: int
    """Output tokens of models."""

    cached_tokens: int
    """Number of input tokens from a cache."""

    usd: float | None = None
    """Cost in US dollars; left out where no note has it."""

    model_s: float | None = None
    """Seconds that models took; left out where no note has them."""

    models: tuple[str, ...] = ()
    """The models that notes name."""

    robots: tuple[RobotUsage, ...] = ()
    """Sums for each robot, from notes that name it; left out where none does."""

    endings: tuple[ModelEnding, ...] = ()
    """Ends of the models' play: one for all robots, or one for each that has reported it."""
