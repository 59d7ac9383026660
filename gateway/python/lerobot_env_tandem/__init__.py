"""Tandem's tasks as environments of LeRobot.

lerobot-eval --env.discover_packages_path=lerobot_env_tandem --env.type=tandem --env.task=Handover-v0 --policy.path=...
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig

import tandem
from gym_tandem import env_id
from gym_tandem.worlds import STATE_COLUMNS

_ACTION = "action"
_STATE = "observation.state"


@EnvConfig.register_subclass("tandem")
@dataclass
class TandemEnvConfig(EnvConfig):
    """What `lerobot-eval` and `lerobot-train` have to know of a task; options are those of `gym_tandem.Options`."""

    task: str | None = "Handover-v0"
    fps: int = 50
    obs_type: str = "pixels_agent_pos"
    observation_height: int = 240
    observation_width: int = 320
    look_every: int = 1
    action_type: str = "joints"
    reward_type: str = "sparse"
    sensors: str = "ideal"
    renderer: str = "auto"
    render_mode: str = "rgb_array"
    features: dict[str, PolicyFeature] = field(default_factory=dict[str, PolicyFeature])
    features_map: dict[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        robots = [robot.robot for robot in self.told.robots]
        width = 35 if self.action_type == "joints" else 32
        self.features[_ACTION] = PolicyFeature(type=FeatureType.ACTION, shape=(len(robots) * width,))
        self.features_map[_ACTION] = _ACTION
        if self.obs_type != "pixels":
            self.features["agent_pos"] = PolicyFeature(type=FeatureType.STATE, shape=(len(robots) * STATE_COLUMNS,))
            self.features_map["agent_pos"] = _STATE
        if self.obs_type != "state":
            shape = (self.observation_height, self.observation_width, 3)
            for robot in robots:
                self.features[f"pixels/{robot}"] = PolicyFeature(type=FeatureType.VISUAL, shape=shape)
                self.features_map[f"pixels/{robot}"] = f"observation.images.{robot}"

    @property
    def told(self) -> Any:
        """The task."""
        tasks = tandem.tasks().tasks
        names = [env_id(task.id).removeprefix(f"{self.package_name}/") for task in tasks]
        if self.task not in names:
            raise ValueError(f"no task {self.task!r}; have: {', '.join(names)}")
        return tasks[names.index(self.task)]

    @property
    def package_name(self) -> str:
        return "gym_tandem"

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        names = (
            "obs_type",
            "observation_height",
            "observation_width",
            "look_every",
            "action_type",
            "reward_type",
            "sensors",
            "renderer",
            "render_mode",
        )
        return {name: getattr(self, name) for name in names}
