"""Tasks as Gymnasium environments."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

gym = pytest.importorskip("gymnasium")


def make(name: str, **settings: Any) -> Any:
    import gym_tandem  # noqa: F401  # pyright: ignore[reportUnusedImport]

    return gym.make(f"gym_tandem/{name}-v0", **settings)


@pytest.mark.parametrize("name", ["Handover", "MoveHouse"])
def test_the_checker_of_gymnasium_passes(name: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = make(name, obs_type="state")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(env.unwrapped, skip_render_check=True)
    assert env.unwrapped.task_description
    assert env.unwrapped._max_episode_steps > 100
    env.close()


def held(observation: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """The action that keeps the robots about as they are."""
    action = np.zeros((len(observation["agent_pos"]) // 47, 35), np.float32)
    action[:, -1] = 0.74
    return action.ravel()


def test_seeds_belong_to_episodes() -> None:
    env = make("Handover", obs_type="state")
    first, info = env.reset(seed=2000)
    assert info["seed"] == 2000
    env.step(held(first))
    second, info = env.reset()
    assert info["seed"] == 2001
    again, _ = env.reset(seed=2001)
    assert np.array_equal(second["agent_pos"], again["agent_pos"])
    env.close()


def test_an_episode_goes_to_its_end() -> None:
    env = make("Handover", obs_type="pixels_agent_pos", render_mode="rgb_array")
    seen, _ = env.reset(seed=2000)
    assert env.observation_space.contains(seen)
    assert {camera: image.shape for camera, image in seen["pixels"].items()} == {"A": (240, 320, 3), "B": (240, 320, 3)}
    assert env.render().shape == (240, 640, 3)
    env.close()

    env = make("Handover", obs_type="state")
    seen, _ = env.reset(seed=2000)
    steps, total = 0, 0.0
    while True:
        seen, reward, terminated, truncated, info = env.step(held(seen))
        steps, total = steps + 1, total + reward
        if terminated or truncated:
            break
    assert (terminated, truncated, info["is_success"], total) == (False, True, False, 0.0)
    assert steps == env.unwrapped._max_episode_steps
    env.close()
