"""One task as a PettingZoo environment: every robot is an agent."""

from __future__ import annotations

from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from pettingzoo import ParallelEnv  # pyright: ignore[reportMissingTypeStubs]
from typing_extensions import Unpack

from .worlds import Observation, Options, Outcome, Worlds

Stepped = tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]


class TandemParallelEnv(ParallelEnv[str, Observation, NDArray[np.float32]]):
    """An episode like that of `TandemEnv`, with the agents `A`, `B` and, in tasks of three robots, `C`.

    Each agent has its own robot's part of observation and action, as in a data set of single robots. Its image is called
    `egocentric`, and `contract` names every number. All agents get the same rewards, and the episode ends for all at once.
    `instructions` has the instruction of each agent.

    Args:
        task: Id of a task, for example "handover".
        options: See `Options`.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "name": "tandem_v0",
        "render_modes": ["rgb_array"],
        "render_fps": 50,
        "is_parallelizable": True,
    }

    def __init__(
        self, task: str = "handover", *, render_mode: Literal["rgb_array"] | None = None, **options: Unpack[Options]
    ) -> None:
        self._worlds = Worlds(task, 1, threads=1, options=options, keeps_last=False, apart=True)
        self.task = task
        self.task_description = self._worlds.task.instruction
        self.instructions = {told.robot: told.instruction for told in self._worlds.task.robots}
        self.contract = self._worlds.contract
        self.metadata = {**type(self).metadata, "render_fps": self.contract.rate_hz}
        self.render_mode = render_mode
        self.possible_agents = list(self._worlds.robots)
        self.agents: list[str] = []
        self.observation_spaces = {agent: self._worlds.observation_dict() for agent in self.possible_agents}
        self.action_spaces = {agent: self._worlds.action_box() for agent in self.possible_agents}

    def observation_space(self, agent: str) -> gym.Space[Any]:
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> gym.Space[Any]:
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        outcome = self._worlds.reset([seed])
        self.agents = list(self.possible_agents)
        return self._observed(), self._infos(outcome)

    def step(self, actions: dict[str, NDArray[np.float32]]) -> Stepped:
        if not self.agents:
            raise gym.error.ResetNeeded("no episode is under way; call reset() first")
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            raise ValueError(f"no action of {', '.join(missing)}; give one of each agent in {self.agents}")
        rows = np.stack([np.asarray(actions[agent], np.float32) for agent in self.possible_agents])
        outcome = self._worlds.step(rows, "disabled")
        agents = self.agents
        if outcome.terminated[0] or outcome.truncated[0]:
            self.agents = []
        return (
            self._observed(),
            dict.fromkeys(agents, float(outcome.rewards[0])),
            dict.fromkeys(agents, bool(outcome.terminated[0])),
            dict.fromkeys(agents, bool(outcome.truncated[0])),
            self._infos(outcome),
        )

    def render(self) -> NDArray[np.uint8] | None:
        """Returns the images of all robots, side by side."""
        return None if self.render_mode is None else self._worlds.draw(0)

    def close(self) -> None:
        self._worlds.close()

    def _observed(self) -> dict[str, Observation]:
        return {agent: self._worlds.of_robot(index) for index, agent in enumerate(self.possible_agents)}

    def _infos(self, outcome: Outcome) -> dict[str, dict[str, Any]]:
        told = self._worlds.info(outcome, 0)
        fallen = told.pop("fallen")
        return {agent: {**told, "fallen": bool(fallen[index])} for index, agent in enumerate(self.possible_agents)}


def parallel_env(
    task: str = "handover", *, render_mode: Literal["rgb_array"] | None = None, **options: Unpack[Options]
) -> TandemParallelEnv:
    """Creates the environment of a task, as PettingZoo's parallel environments are created."""
    return TandemParallelEnv(task, render_mode=render_mode, **options)
