"""Tandem's tasks as environments of Gymnasium, one at a time or many, and of PettingZoo.

`gymnasium.make("gym_tandem/Handover-v0")` and `gymnasium.make_vec("gym_tandem/Handover-v0", num_envs=8)`, after
`import gym_tandem`; `gym_tandem.parallel.parallel_env("handover")`.
"""

from __future__ import annotations

import gymnasium as gym

import tandem

from .env import TandemEnv
from .vector import TandemVectorEnv
from .worlds import Options


def env_id(task: str) -> str:
    """Returns Gymnasium's id of a task: "gym_tandem/CoCarry-v0" for "co_carry"."""
    name = "".join(part.capitalize() for part in task.split("_"))
    return f"gym_tandem/{name}-v0"


for _task in tandem.tasks().tasks:
    gym.register(  # pyright: ignore[reportUnknownMemberType]
        env_id(_task.id),
        "gym_tandem.env:TandemEnv",
        vector_entry_point="gym_tandem.vector:TandemVectorEnv",
        kwargs={"task": _task.id},
    )

__all__ = ["Options", "TandemEnv", "TandemVectorEnv", "env_id"]
