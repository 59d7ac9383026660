"""One task as a Gymnasium environment for learned policies that direct all robots."""

from __future__ import annotations

from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import tandem

Observation = dict[str, Any]


class TandemEnv(gym.Env[Observation, NDArray[np.float32]]):
    """An episode under the benchmark protocol; a step is one control step of 20 ms.

    Observations: `agent_pos`, float32, for each robot in turn 43 joint angles in radians and the base command (m/s, m/s, rad/s,
    m), and with `obs_type="pixels_agent_pos"` also `pixels`: by robot what its head camera sees, 240 by 320 by 3, uint8.
    Actions: float32, for each robot in turn 31 joint targets in radians and the base command.
    Rewards: 1 for each phase in the step that reaches it, 0 otherwise; a whole episode gives at most 3.
    An episode terminates with the last phase or with a fall, and is truncated when its steps are used up.

    `reset(seed=n)` begins the episode of seed n; without a seed, that of the seed after the last one: the episode's index alone
    says where it begins, however often anything was reset between.

    task: A task's id, as "handover".
    obs_type: What is observed.
    renderer: Who draws.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(
        self,
        task: str = "handover",
        obs_type: Literal["state", "pixels_agent_pos"] = "pixels_agent_pos",
        render_mode: Literal["rgb_array"] | None = None,
        renderer: Literal["auto", "cpu", "gpu"] = "auto",
    ) -> None:
        told = next((entry for entry in tandem.tasks().tasks if entry.id == task), None)
        if told is None:
            have = ", ".join(entry.id for entry in tandem.tasks().tasks)
            raise ValueError(f"no task {task!r}; have: {have}")
        rules = next(rules for rules in told.protocols if rules.protocol == "benchmark")
        self.task = task
        self.task_description = told.instruction
        self.render_mode = render_mode
        self._max_episode_steps = rules.episode_steps - rules.initial_hold_steps
        self._phases = len(told.phases)
        self._robots = tuple(instruction.robot for instruction in told.robots)
        self._pixels = obs_type == "pixels_agent_pos"
        self._renderer: Literal["auto", "cpu", "gpu"] = renderer
        self._episode: tandem.Episode | None = None
        self._columns: NDArray[np.intp] = np.array([], np.intp)
        self._seed: int | None = None
        self._reached = 0
        robots = len(self._robots)
        # What lies beyond a joint's limit, or beyond what the base follows, is moved there.
        self.action_space = gym.spaces.Box(-np.pi, np.pi, (robots * 35,), np.float32)
        spaces: dict[str, gym.Space[Any]] = {"agent_pos": gym.spaces.Box(-np.inf, np.inf, (robots * 47,), np.float32)}
        if self._pixels:
            picture = gym.spaces.Box(0, 255, (240, 320, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict({robot: picture for robot in self._robots})
        self.observation_space = gym.spaces.Dict(spaces)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        if seed is None:
            seed = 0 if self._seed is None else self._seed + 1
        super().reset(seed=seed)
        self._seed = seed
        self.close()
        self._episode = tandem.Episode(self.task, seed, protocol="benchmark", renderer=self._renderer)
        self._episode.start()
        self._reached = 0
        names = self._episode.state_columns
        base = ("vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m")
        wanted = [*range(43), *(names.index(column) for column in base)]
        self._columns = np.array(wanted, np.intp)
        return self._observe(), self._info(())

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        rows = np.reshape(np.asarray(action, np.float32), (len(self._robots), 35))
        stepped = self._running.step(rows)
        reward = float(len(stepped.phases) - self._reached)
        self._reached = len(stepped.phases)
        terminated = self._reached == self._phases or any(stepped.fallen)
        truncated = stepped.ended and not terminated
        return self._observe(), reward, terminated, truncated, self._info(stepped.phases)

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """What all robots see, side by side."""
        if self.render_mode is None:
            return None
        return np.concatenate(list(self._running.observe().rgb.values()), axis=1)

    def close(self) -> None:
        if self._episode is not None:
            self._episode.close()
            self._episode = None

    @property
    def _running(self) -> tandem.Episode:
        if self._episode is None:
            raise gym.error.ResetNeeded("no episode has begun; call reset() first")
        return self._episode

    def _observe(self) -> Observation:
        episode = self._running
        seen: Observation = {"agent_pos": episode.state()[:, self._columns].ravel()}
        if self._pixels:
            seen["pixels"] = episode.observe(short=True).rgb
        return seen

    def _info(self, phases: tuple[str, ...]) -> dict[str, Any]:
        return {"is_success": len(phases) == self._phases, "phases": phases, "seed": self._seed}
