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
    """End of a model's play, in its own words, too."""

    robot: str | None = None
    """The robot that it directed; left out where it directed all."""

    ending: AgentEnding
    """The end."""

    text: str
    """The words of the model or of its endpoint, as of a refusal; empty where there are none."""


@dataclass(frozen=True, kw_only=True)
class OperatorUse(Reply):
    """Requests and thinking time of a robot's operator up to its last command."""

    robot: str
    """The robot, for example "A"."""

    requests: int
    """Its operator's requests."""

    thinking_s: float
    """Wall clock that the operator has thought since its first request, while no step was made, in seconds."""


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
    """Times in simulated seconds at which phases were reached; null where one was not, or is not disclosed."""

    success: bool | None = None
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

    requests: int | None = None
    """Requests of the policy itself: like tool_calls, but a plan or a walk, whose commands are a call each, counts
    once. Left out in results of earlier versions.
    """

    thinking_s: float | None = None
    """Wall clock that the policy has thought between its calls, in seconds; where each robot has its own operator,
    that of all operators together.
    """

    operators: tuple[OperatorUse, ...] = ()
    """Use by each operator that has commanded, where each robot has its own; left out otherwise."""

    falls: int
    """Robots that fell."""

    realtime_factor: float
    """Simulated seconds per second that the physics took."""

    state_hash: str | None = None
    """Hash of the whole physical state at the end, 16 hexadecimal digits; left out for a policy whose assistance
    is "paper".
    """

    simulator_failure: str | None = None
    """Failure of the simulator: its step, body and error; left out where it did not fail."""

    assistance: Assistance | None = None
    """Amount of information that the policy got."""

    extra_information: tuple[str, ...] = ()
    """Information that the policy got beyond the benchmark's own policies, for example "depth_images"; left out
    where it was none.
    """

    extra_information_replies: dict[str, dict[str, int]] = field(default_factory=dict[str, dict[str, int]])
    """Number of replies with each of it, by its name and by the robot it was of; left out where it was none, and
    of a short reply.
    """

    joints_clamped_share: float | None = None
    """Share of the joint targets that lay beyond the joints' limits by more than 0.01 rad, and were moved there;
    left out where none did.
    """

    departures: tuple[str, ...] = ()
    """Departures from the benchmark, for example "assistance: full"; left out where there was none."""

    recording_failed: str | None = None
    """Why the recording is not complete; left out where it is."""

    usage: Usage | None = None
    """Usage that notes on the episode report; left out where there are none."""


@dataclass(frozen=True, kw_only=True)
class RobotUsage(Reply):
    """Usage of the model of one robot."""

    robot: str
    """The robot that it directed."""

    model: str | None = None
    """The model, as its latest note names it; left out where none does."""

    input_tokens: int
    """Tokens that it read, those from a cache included."""

    output_tokens: int
    """Tokens that it wrote."""

    cached_tokens: int
    """Number of read tokens that came from a cache."""

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
    """Tokens that models read, those from a cache included."""

    output_tokens: int
    """Tokens that models wrote."""

    cached_tokens: int
    """Number of read tokens that came from a cache."""

    usd: float | None = None
    """Cost in US dollars; left out where no note has it."""

    model_s: float | None = None
    """Seconds that models took; left out where no note has them."""

    models: tuple[str, ...] = ()
    """The models that notes name."""

    robots: tuple[RobotUsage, ...] = ()
    """Parts of the sums that belong to one robot, of notes that name it; left out where none does."""

    endings: tuple[ModelEnding, ...] = ()
    """Ends of the models' play: one for all robots, or one for each that has reported it."""
