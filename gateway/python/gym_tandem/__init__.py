"""Tandem's tasks as Gymnasium environments: `gymnasium.make("gym_tandem/Handover-v0")`, after `import gym_tandem`."""

from __future__ import annotations

import gymnasium as gym

import tandem

from .env import TandemEnv

for _task in tandem.tasks().tasks:
    _name = "".join(part.capitalize() for part in _task.id.split("_"))
    _id = f"gym_tandem/{_name}-v0"
    gym.register(_id, "gym_tandem.env:TandemEnv", kwargs={"task": _task.id})  # pyright: ignore[reportUnknownMemberType]

__all__ = ["TandemEnv"]
