"""Tandem's tasks as an environment of OpenEnv: a server of episodes, and its client.

python -m openenv_tandem --port 8000

    with TandemClient(base_url="http://localhost:8000").sync() as client:
        began = client.reset(task="handover", seed=2000)
        looked = client.step(TandemAction(tool="observe"))
"""

from __future__ import annotations

import argparse
from typing import Any, Literal, cast
from uuid import uuid4

from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from openenv.core.env_server.http_server import create_app
from openenv.core.env_server.interfaces import Environment
from openenv.core.env_server.types import Action, ConcurrencyConfig, EnvironmentMetadata, Observation, State
from pydantic import Field

import tandem

_WORLDS = 16

_IDLE_S = 3600.0
"""A session without a call for so long ends, and its episode with it."""


class TandemAction(Action):
    """A call of one of Tandem's tools, which the book describes."""

    tool: str = Field(description='The name of a tool, as "observe", "move_wrists" or "send_joint_chunk".')
    arguments: dict[str, Any] = Field(default_factory=dict[str, Any], description="Its arguments.")


class TandemObservation(Observation):
    """Reply of the tool, or the reason for a refusal. At a reset, the briefing of the episode.

    The reward of a call is the number of phases that it reached, so that a whole episode gives at most 3.
    """

    reply: dict[str, Any] | None = Field(default=None, description="The tool's reply; pictures are PNG files in base64.")
    problem: str | None = Field(default=None, description="Why the call was refused, and what would work.")
    result: dict[str, Any] | None = Field(default=None, description="What the episode came to, once it has ended.")


class TandemState(State):
    """State of the episode; `step_count` is the number of control steps of 20 ms."""

    task: str | None = None
    seed: int | None = None
    phases: int = 0
    ended: str | None = None


class TandemEnvironment(Environment[TandemAction, TandemObservation, TandemState]):
    """Environment of one episode after another. `reset` takes `task`, `seed`, `protocol` ("agentic" or "benchmark") and
    `assistance` ("full" or "paper"). With "paper", phases are reported and rewarded when the episode ends. Without a seed,
    the episode has the seed after the last one, at first 2000: 0 to 100 are for results.
    """

    SUPPORTS_CONCURRENT_SESSIONS = True

    def __init__(self) -> None:
        super().__init__()
        self._episode: tandem.Episode | None = None
        self._state = TandemState()
        self._result: dict[str, Any] | None = None
        self._next_seed = 2000

    def reset(
        self,
        seed: int | None = None,
        episode_id: str | None = None,
        task: str = "handover",
        protocol: Literal["agentic", "benchmark"] = "agentic",
        assistance: Literal["full", "paper"] = "full",
        **unknown: Any,
    ) -> TandemObservation:
        if unknown:
            raise ValueError(f"no setting {', '.join(unknown)}; have: task, seed, protocol, assistance")
        begun = self._next_seed if seed is None else seed
        # A failed start leaves the running episode unchanged.
        episode = tandem.Episode(task, begun, protocol=protocol, assistance=assistance)
        briefing = episode.start()
        self.close()
        self._episode, self._next_seed = episode, begun + 1
        self._state = TandemState(episode_id=episode_id or str(uuid4()), task=task, seed=begun)
        self._result = None
        return TandemObservation(reply={"brief": briefing.brief, "instruction": briefing.instruction}, reward=0.0)

    def step(self, action: TandemAction, timeout_s: float | None = None, **unknown: Any) -> TandemObservation:
        if self._episode is None:
            raise RuntimeError("no episode has begun; call reset first")
        reply: Any = None
        problem = None
        try:
            reply = self._episode.call(action.tool, action.arguments)
        except tandem.TandemError as error:
            problem = str(error)
        # Replies to observations, and with "paper" all replies, do not report phases. The reply to `finish` has their times.
        reached: Any = reply["phases"] if reply is not None and "phases" in reply else None
        phases = len(cast("list[Any]", reached)) if isinstance(reached, list) else self._state.phases
        if self._episode.ended is not None and self._result is None:
            result: Any = self._episode.call("finish", {})
            self._result = result
            phases = sum(at is not None for at in result["phases"].values())
        earned, self._state.phases = phases - self._state.phases, phases
        return TandemObservation(
            reply=reply, problem=problem, result=self._result, done=self._result is not None, reward=float(earned)
        )

    @property
    def state(self) -> TandemState:
        if self._episode is not None:
            status = self._episode.call("get_status", {})
            self._state.step_count, self._state.ended = status["env_steps"], status["ended"]
        return self._state

    def get_metadata(self) -> EnvironmentMetadata:
        tasks = ", ".join(told.id for told in tandem.tasks().tasks)
        about = f"Two or three humanoids that have to work together, by calls of tools. Tasks: {tasks}."
        return EnvironmentMetadata(name="tandem", description=about, version=tandem.__version__)

    def close(self) -> None:
        if self._episode is not None:
            self._episode.close()
            self._episode = None


class TandemClient(EnvClient[TandemAction, TandemObservation, TandemState]):
    """Creates a session of the server, with one episode at a time."""

    def _step_payload(self, action: TandemAction) -> dict[str, Any]:
        return action.model_dump()

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[TandemObservation]:
        done, reward = bool(payload["done"]), payload["reward"]
        observed: dict[str, Any] = {**payload["observation"], "done": done, "reward": reward}
        return StepResult(TandemObservation(**observed), reward, done)

    def _parse_state(self, payload: dict[str, Any]) -> TandemState:
        return TandemState(**payload)


app = create_app(
    TandemEnvironment,
    TandemAction,
    TandemObservation,
    "tandem",
    concurrency_config=ConcurrencyConfig(max_concurrent_envs=_WORLDS, session_timeout=_IDLE_S),
    state_cls=TandemState,
)
"""Application for a server, for example `uvicorn openenv_tandem:app`."""


def main() -> None:
    import uvicorn

    parser = argparse.ArgumentParser(
        prog="python -m openenv_tandem", description="Serves Tandem's tasks to clients of OpenEnv."
    )
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)
    args = parser.parse_args()
    uvicorn.run(app, host=args.host, port=args.port)


__all__ = ["TandemAction", "TandemClient", "TandemEnvironment", "TandemObservation", "TandemState", "app", "main"]
