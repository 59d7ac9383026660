"""One task as a Gymnasium environment for learned policies that direct all robots."""

from __future__ import annotations

from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from typing_extensions import Unpack

from .worlds import Observation, Options, Outcome, Worlds


class TandemEnv(gym.Env[Observation, NDArray[np.float32]]):
    """An episode under the benchmark protocol. A step is one control step of 20 ms.

    With `fps` a step is as long as a row of a data set.

    Observations: `agent_pos`, float32, for each robot in turn 43 joint angles in radians and the base command (m/s, m/s, rad/s,
    m). `pixels` has the image of each robot's head camera, height by width by 3, uint8.
    Actions: float32, for each robot in turn 31 joint targets in radians and the base command; with `action_type="wrists"` both
    wrists' poses in its pelvis frame (x, y, z in metres, then w, x, y, z), both hands' fingers (7 angles in radians each) and
    the base command.
    `contract` names every number, with its unit and range.
    Rewards: 1 in the step that reaches a phase. With `reward_type="dense"`, the increase of progress in the step: the number of
    phases reached, plus the nearness of the next one, from 0 to 1. A whole episode gives at most 3 in both cases.
    An episode terminates with the last phase or with a fall, and is truncated when its steps are used up.

    `reset(seed=n)` begins the episode of seed n. Without a seed it begins that of the seed after the last one, at first 2000.
    The start of an episode depends on its seed alone, and not on earlier resets.

    Args:
        task: Id of a task, for example "handover".
        options: See `Options`.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012

    def __init__(
        self, task: str = "handover", *, render_mode: Literal["rgb_array"] | None = None, **options: Unpack[Options]
    ) -> None:
        self._worlds = Worlds(task, 1, threads=1, options=options, keeps_last=False)
        self.task = task
        self.task_description = self._worlds.task.instruction
        self._max_episode_steps = self._worlds.max_episode_steps
        self.contract = self._worlds.contract
        self.metadata = {**type(self).metadata, "render_fps": self.contract.rate_hz}
        self.render_mode = render_mode
        self.action_space = self._worlds.action_box()
        self.observation_space = self._worlds.observation_dict()
        self._has_begun = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        super().reset(seed=None if seed is None else int(seed))
        outcome = self._worlds.reset([seed])
        self._has_begun = True
        return self._worlds.of_world(0), self._info(outcome)

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        if not self._has_begun:
            raise gym.error.ResetNeeded("no episode has begun; call reset() first")
        outcome = self._worlds.step(action, "disabled")
        rewarded, terminated, truncated = outcome.rewards[0], outcome.terminated[0], outcome.truncated[0]
        return self._worlds.of_world(0), float(rewarded), bool(terminated), bool(truncated), self._info(outcome)

    def render(self) -> NDArray[np.uint8] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Returns the images of all robots, side by side."""
        return None if self.render_mode is None else self._worlds.draw(0)

    def state_hash(self) -> str:
        """Returns 16 hexadecimal digits that are equal for equal physical states of the same build."""
        return self._worlds.state_hash(0)

    def close(self) -> None:
        self._worlds.close()

    def _info(self, outcome: Outcome) -> dict[str, Any]:
        return self._worlds.info(outcome, 0)
