"""Many episodes of one task as one Gymnasium environment: one call steps all worlds, in Rust."""

from __future__ import annotations

from copy import deepcopy
from typing import Any, Literal

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from typing_extensions import Unpack

from tandem.base import integer

from .worlds import Observation, Options, Outcome, Worlds

Stepped = tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class WorldView:
    """Read-only view of one world of a vector environment."""

    def __init__(self, vector: TandemVectorEnv, world: int) -> None:
        self._vector = vector
        self._world = world
        self.task = vector.task
        self.task_description = vector.task_description
        self.render_mode = vector.render_mode
        self.metadata = vector.metadata
        self._max_episode_steps = vector.max_episode_steps

    def render(self) -> NDArray[np.uint8] | None:
        """Returns the images of all robots of the world, side by side."""
        return self._vector.draw(self._world)


class TandemVectorEnv(VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]):
    """Episodes like those of `TandemEnv`, in worlds that step on threads of their own, with Python's lock released.

    `reset(seed=n)` begins episode n + i in world i; a list has a seed for each world. The k-th episode that begins
    automatically in a world has the seed increased by k times the number of worlds. `reset()` without a seed begins the round
    after the last one. No episode depends on the length of another one.

    Args:
        task: Id of a task, for example "handover".
        num_envs: Number of worlds.
        autoreset_mode: Beginning of the next episode in a world whose last one is over: in place of the next step, in the
            same step (`final_obs` and `final_info` have the end of the last one), or only by
            `reset(options={"reset_mask": ...})`.
        threads: Number of threads on which worlds step. 0: one per core.
        copy: False: observations are the arrays that the next step writes into.
        options: See `Options`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(
        self,
        task: str = "handover",
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 0,
        copy: bool = True,
        render_mode: Literal["rgb_array"] | None = None,
        **options: Unpack[Options],
    ) -> None:
        mode = AutoresetMode(autoreset_mode)
        self._worlds = Worlds(task, num_envs, threads=threads, options=options, keeps_last=mode == AutoresetMode.SAME_STEP)
        self._autoreset = mode.name.lower()
        self._copy = copy
        self.num_envs = num_envs
        self.task = task
        self.task_description = self._worlds.task.instruction
        self.max_episode_steps = self._worlds.max_episode_steps
        self.render_mode = render_mode
        self.contract = self._worlds.contract
        self.metadata = {**type(self).metadata, "render_fps": self.contract.rate_hz, "autoreset_mode": mode}
        actions: Any = self._worlds.action_box()
        self.single_action_space = actions
        self.single_observation_space = self._worlds.observation_dict()
        self.action_space = batch_space(actions, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        if seed is None or isinstance(seed, int | np.integer):
            first = None if seed is None else integer(seed, "the seed")
            super().reset(seed=first)
            seeds: list[int | None] = [None if first is None else first + world for world in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} worlds; give one for each")
        mask = None if options is None else options.get("reset_mask")
        if mask is None:
            outcome = self._worlds.reset(seeds)
            return self._observed(), self._infos(outcome)
        chosen = np.asarray(mask, np.bool_)
        if chosen.shape != (self.num_envs,) or not chosen.any():
            raise ValueError(f"reset_mask is {mask}; give {self.num_envs} truth values, at least one of them True")
        outcome = self._worlds.reset(seeds, chosen.tolist())
        return self._observed(), self._infos(outcome, chosen)

    def step(self, actions: NDArray[np.float32]) -> Stepped:
        outcome = self._worlds.step(actions, self._autoreset)
        return self._observed(), outcome.rewards, outcome.terminated, outcome.truncated, self._infos(outcome)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Returns the images of all robots of each world, side by side."""
        if self.render_mode is None:
            return None
        return tuple(self._worlds.draw(world) for world in range(self.num_envs))

    @property
    def envs(self) -> tuple[WorldView, ...]:
        """Views of the worlds, which harnesses request as from a `SyncVectorEnv`."""
        return tuple(WorldView(self, world) for world in range(self.num_envs))

    def draw(self, world: int) -> NDArray[np.uint8] | None:
        """Returns the images of all robots of a world, side by side."""
        return None if self.render_mode is None else self._worlds.draw(world)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Returns an attribute of each world, or the result of its method."""
        found = [getattr(env, name) for env in self.envs]
        return tuple(of(*args, **kwargs) if callable(of) else of for of in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Returns an attribute of each world."""
        return self.call(name)

    def state_hashes(self) -> tuple[str, ...]:
        """Returns a hash for each world, which is equal for equal physical states of the same build."""
        return tuple(self._worlds.state_hash(world) for world in range(self.num_envs))

    def close_extras(self, **kwargs: Any) -> None:
        self._worlds.close()

    def _observed(self) -> Observation:
        seen = self._worlds.batch()
        return deepcopy(seen) if self._copy else seen

    def _infos(self, outcome: Outcome, chosen: NDArray[np.bool_] | None = None) -> dict[str, Any]:
        """Returns arrays with an entry per world, each with a mask of the entries of this step."""
        of_all: NDArray[np.bool_] = np.ones(self.num_envs, np.bool_) if chosen is None else chosen
        anew = outcome.next_seeds >= 0
        phases = np.where(anew, 0, outcome.phases)
        told: dict[str, NDArray[Any]] = {
            "is_success": phases == len(self._worlds.task.phases),
            "phases": phases,
            "fallen": outcome.fallen & ~anew[:, np.newaxis],
            "seed": np.where(anew, outcome.next_seeds, outcome.seeds),
        }
        infos: dict[str, Any] = {}
        for key, value in told.items():
            infos[key], infos[f"_{key}"] = value, np.array(of_all)
        for world, how in outcome.failures:
            infos = self._add_info(infos, {"simulator_failure": how}, world)
        for world in np.flatnonzero(anew).tolist():
            last = {"final_obs": self._worlds.of_world(world, last=True), "final_info": self._worlds.info(outcome, world)}
            infos = self._add_info(infos, last, world)
        return infos
