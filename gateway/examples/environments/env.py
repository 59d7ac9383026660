"""Tandem as an environment of LeRobot's EnvHub: put this file into a repository of the hub, and its name into `make_env`.

LeRobot calls `make_env(n_envs, use_async_envs, cfg)` and gets a vector environment of each task, by suite and number. All
worlds of a vector environment step in Rust on threads of their own, whether or not processes are requested.
"""

from __future__ import annotations

from typing import Any

from gymnasium.vector import AutoresetMode, SyncVectorEnv

from gym_tandem import TandemVectorEnv
from tandem.rows import DEFAULT_DATA_RATE_HZ

TASKS = ("handover", "co_carry")


class FilmedVectorEnv(TandemVectorEnv, SyncVectorEnv):  # pyright: ignore[reportIncompatibleVariableOverride]
    """Environment for the films of `lerobot-eval`, which reads images only from the `envs` of a `SyncVectorEnv`."""


def make_env(n_envs: int = 1, use_async_envs: bool = False, cfg: Any = None) -> dict[str, dict[int, TandemVectorEnv]]:
    """Vector environments of `TASKS`."""
    as_exported: dict[str, Any] = {"fps": DEFAULT_DATA_RATE_HZ, "render_mode": "rgb_array"}
    options: dict[str, Any] = as_exported if cfg is None else cfg.gym_kwargs
    made = [FilmedVectorEnv(task, n_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options) for task in TASKS]
    return {"tandem": dict(enumerate(made))}
