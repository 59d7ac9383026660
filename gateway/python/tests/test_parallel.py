"""Robots as agents of a PettingZoo environment."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pettingzoo")


def make(task: str = "handover", **settings: Any) -> Any:
    from gym_tandem.parallel import parallel_env

    options: Any = {"obs_type": "state", **settings}
    return parallel_env(task, **options)


@pytest.mark.parametrize("task", ["handover", "big_table"])
def test_the_tests_of_pettingzoo_pass(task: str) -> None:
    tests: Any = pytest.importorskip("pettingzoo.test")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        tests.parallel_api_test(make(task), num_cycles=50)
        tests.parallel_seed_test(lambda: make(task), num_cycles=10)


def test_agents_are_the_robots() -> None:
    from gym_tandem import TandemEnv

    env = make("big_table", obs_type="pixels_agent_pos", observation_width=32, observation_height=24)
    assert env.possible_agents == ["A", "B", "C"]
    seen, infos = env.reset(seed=2003)
    assert env.agents == ["A", "B", "C"]
    assert {agent: list(of["pixels"]) for agent, of in seen.items()} == {agent: ["egocentric"] for agent in "ABC"}
    assert all(env.observation_space(agent).contains(seen[agent]) for agent in env.agents)
    assert infos["C"]["seed"] == 2003
    rows = np.zeros((3, 35), np.float32)
    rows[:, -1], rows[1, 3] = 0.74, 0.4
    together = TandemEnv("big_table", obs_type="state")
    together.reset(seed=2003)
    actions = dict(zip("ABC", rows, strict=True))
    for _ in range(4):
        env.step(actions)
        together.step(rows.ravel())
    seen, rewards, terminated, _, _ = env.step(actions)
    whole, reward, _, _, _ = together.step(rows.ravel())
    assert np.array_equal(np.concatenate([seen[agent]["agent_pos"] for agent in "ABC"]), whole["agent_pos"])
    assert (rewards, terminated) == (dict.fromkeys("ABC", reward), dict.fromkeys("ABC", False))
    with pytest.raises(ValueError, match="no action of B, C"):
        env.step({"A": rows[0]})
    env.close()
