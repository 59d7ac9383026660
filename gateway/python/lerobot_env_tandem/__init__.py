"""Tandem's tasks as environments of LeRobot, with the rows of data sets of `tandem export lerobot`.

lerobot-eval --env.discover_packages_path=lerobot_env_tandem --env.type=tandem --env.task=Handover-v0 --policy.path=...
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig

import tandem
from gym_tandem import Options, env_id
from gym_tandem.worlds import environment_contract
from tandem.rows import ACTION, DEFAULT_DATA_RATE_HZ, DEFAULT_SIZE_PX, IMAGES, STATE, check_contract


@EnvConfig.register_subclass("tandem")
@dataclass
class TandemEnvConfig(EnvConfig):
    """Description of a task for `lerobot-eval` and `lerobot-train`; options are those of `gym_tandem.Options`.

    Rate and image size are by default those of `tandem export lerobot`. With `data_set`, any difference from the rows of the
    data set is refused.
    """

    task: str | None = "Handover-v0"
    fps: int = DEFAULT_DATA_RATE_HZ
    data_set: str | None = None
    obs_type: str = "pixels_agent_pos"
    observation_height: int = DEFAULT_SIZE_PX[1]
    observation_width: int = DEFAULT_SIZE_PX[0]
    look_every: int = 1
    action_type: str = "joints"
    reward_type: str = "sparse"
    sensors: str = "ideal"
    camera: str = "ideal"
    renderer: str = "auto"
    render_mode: str = "rgb_array"
    features: dict[str, PolicyFeature] = field(default_factory=dict[str, PolicyFeature])
    features_map: dict[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        options: Any = {name: getattr(self, name) for name in Options.__annotations__ if hasattr(self, name)}
        contract = environment_contract(self.told, options)
        if self.data_set is not None:
            check_contract(self.data_set, contract)
        self._add("action", ACTION, FeatureType.ACTION, (len(contract.action),))
        if contract.state:
            self._add("agent_pos", STATE, FeatureType.STATE, (len(contract.state),))
        for name, (width, height) in contract.images.items():
            self._add(f"pixels/{name}", IMAGES + name, FeatureType.VISUAL, (height, width, 3))

    def _add(self, name: str, key: str, kind: FeatureType, shape: tuple[int, ...]) -> None:
        self.features[name] = PolicyFeature(type=kind, shape=shape)
        self.features_map[name] = key

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
            "fps",
            "obs_type",
            "observation_height",
            "observation_width",
            "look_every",
            "action_type",
            "reward_type",
            "sensors",
            "camera",
            "renderer",
            "render_mode",
        )
        return {name: getattr(self, name) for name in names}
