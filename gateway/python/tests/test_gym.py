"""Tasks as Gymnasium environments."""

from __future__ import annotations

import itertools
import subprocess
import sys
import warnings
from pathlib import Path
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
        # The warning that joint limits are not -1 to 1 is repeated each time. All other warnings are errors.
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(symmetric|normalized|infinity).*")
        check_env(env.unwrapped, skip_render_check=True)
    assert env.unwrapped.task_description
    assert env.unwrapped._max_episode_steps > 100
    env.close()


def held(observation: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """The action that nearly keeps the robots in their present state."""
    action = np.zeros((len(observation["agent_pos"]) // 47, 35), np.float32)
    action[:, -1] = 0.74
    return action.ravel()


def test_stress_is_laid_over_the_same_episode() -> None:
    """Stress of the requested axis and level. The level is 1 by default."""

    def begun(**settings: Any) -> tuple[str, str]:
        env = make("Handover", obs_type="state", **settings)
        observation, _ = env.reset(seed=2000)
        env.step(held(observation))
        told = env.unwrapped.state_hash(), env.unwrapped.task_description
        env.close()
        return told

    plain, said = begun()
    masses = [begun(stress="mass", **level)[0] for level in ({}, {"level": 1}, {"level": 3})]
    assert masses[0] == masses[1] and len({plain, *masses}) == 3
    # Other wordings change only the instructions.
    for_words, in_words = begun(stress="words", level=3)
    assert for_words == plain and in_words != said
    with pytest.raises(Exception, match="expected one of `camera`"):
        make("Handover", stress="lihgt")
    with pytest.raises(Exception, match="give stress, too"):
        make("Handover", level=2)


def test_seeds_belong_to_episodes() -> None:
    env = make("Handover", obs_type="state")
    _, info = env.reset()
    assert info["seed"] == 2000
    first, info = env.reset(seed=2004)
    assert info["seed"] == 2004
    env.step(held(first))
    second, info = env.reset()
    assert info["seed"] == 2005
    there = env.unwrapped.state_hash()
    again, _ = env.reset(seed=2005)
    assert np.array_equal(second["agent_pos"], again["agent_pos"])
    assert env.unwrapped.state_hash() == there
    with pytest.raises(ValueError, match="0 to 4294967295"):
        env.unwrapped._worlds.reset([2**32])
    env.close()


def test_a_step_is_a_step_of_the_episode() -> None:
    import tandem

    env = make("Handover", obs_type="state")
    seen, _ = env.reset(seed=2000)
    action: Any = held(seen)
    action[3] = 0.3
    for _ in range(30):
        seen, _, _, _, _ = env.step(action)
    with tandem.Episode("handover", 2000, protocol="benchmark") as episode:
        episode.step(np.repeat(action.reshape(2, 1, 35), 30, axis=1))
        assert env.unwrapped.state_hash() == episode.state_hash
        assert np.array_equal(seen["agent_pos"].reshape(2, 47)[:, :43], episode.state()[:, :43])
    env.close()


def test_an_episode_goes_to_its_end() -> None:
    env = make("Handover", obs_type="pixels_agent_pos", render_mode="rgb_array")
    seen, _ = env.reset(seed=2000)
    assert env.observation_space.contains(seen)
    assert {camera: image.shape for camera, image in seen["pixels"].items()} == {"A": (240, 320, 3), "B": (240, 320, 3)}
    assert np.array_equal(env.render(), np.concatenate([seen["pixels"]["A"], seen["pixels"]["B"]], axis=1))
    env.close()

    env = make("Handover", obs_type="state")
    seen, _ = env.reset(seed=2000)
    steps, total = 0, 0.0
    while True:
        seen, reward, terminated, truncated, info = env.step(held(seen))
        steps, total = steps + 1, total + reward
        if terminated or truncated:
            break
    assert (terminated, truncated, info["is_success"], info["phases"], total) == (False, True, False, 0, 0.0)
    assert steps == env.unwrapped._max_episode_steps
    with pytest.raises(Exception, match="reset it first"):
        env.step(held(seen))
    env.close()


def test_pictures_have_any_size_and_are_drawn_where_the_policy_looks() -> None:
    env = make("Handover", observation_width=64, observation_height=48, look_every=3, renderer="cpu")
    seen, _ = env.reset(seed=2000)
    pictures = [seen["pixels"]["B"]]
    assert pictures[0].shape == (48, 64, 3)
    for _ in range(4):
        pictures.append(env.step(held(seen))[0]["pixels"]["B"])
    drawn = [not np.array_equal(before, after) for before, after in itertools.pairwise(pictures)]
    assert drawn == [False, False, True, False]
    env.close()


def test_wrists_are_sent_to_poses_and_dense_rewards_follow_them() -> None:
    env = make("Handover", obs_type="state", action_type="wrists", reward_type="dense")
    env.reset(seed=2000)
    row = np.zeros(32, np.float32)
    row[:7], row[7:14], row[-1] = (0.25, 0.25, 0.1, 1, 0, 0, 0), (0.25, -0.25, 0.1, 1, 0, 0, 0), 0.74
    assert env.action_space.shape == (64,)
    total = sum(env.step(np.tile(row, 2))[1] for _ in range(50))
    assert 0.005 < total < 1.0
    with pytest.raises(Exception, match="quaternion"):
        env.step(np.zeros(64, np.float32))
    env.close()


def test_what_an_expert_did_succeeds_step_for_step_and_is_rewarded(tmp_path: Path) -> None:
    import gym_tandem
    import tandem

    played = ("evaluate", "--policy", "expert", "--tasks", "handover,big_table", "--seeds", "2003")
    kept = ("--protocol", "benchmark", "--record", "--out", "expert")
    subprocess.run([sys.executable, "-m", "tandem", *played, *kept], cwd=tmp_path, check=True)
    for task in ("handover", "big_table"):
        recording = tandem.Recording(tmp_path / f"expert/episodes/{task}-2003")
        result: Any = recording.result
        env = gym_tandem.TandemEnv(task, obs_type="state", reward_type="dense")
        env.reset(seed=2003)
        rewards: list[float] = []
        phases, info = [0], dict[str, Any]()
        # Rows begin with that before the first step.
        for action in recording.actions[1:]:
            _, reward, terminated, truncated, info = env.step(action.ravel())
            rewards.append(reward)
            phases.append(info["phases"])
            assert not truncated
            if terminated:
                break
        assert info["is_success"]
        assert env.state_hash() == recording.state_hashes[len(rewards)]
        reached_s = [0.02 * phases.index(phase) for phase in (1, 2, 3)]
        assert np.allclose(reached_s, list(result.phases.values()))
        # All three phases, minus the initial progress towards the first.
        assert 2.5 < sum(rewards) < 3.0
        # Most rewards come before a phase is reached.
        before = sum(rewards[: phases.index(1) - 1])
        assert before > 0.2
        env.close()


def test_what_is_not_there_is_refused_with_what_is() -> None:
    with pytest.raises(ValueError, match="have: handover, pouring"):
        make("Handover", task="handove")
    with pytest.raises(TypeError, match="no option view; have: obs_type"):
        make("Handover", view="A")
    with pytest.raises(ValueError, match="no camera 'A'; have: ideal, d435i"):
        make("Handover", camera="A")
    with pytest.raises(Exception, match="have: sparse, dense"):
        make("Handover", reward_type="shaped")
    with pytest.raises(ValueError, match="no obs_type 'pixel'; have: pixels_agent_pos, pixels, state"):
        make("Handover", obs_type="pixel")
    with pytest.raises(TypeError, match=r"look_every is 1\.5; give a whole number"):
        make("Handover", look_every=1.5)
    env = make("Handover", obs_type="state")
    env.reset()
    for shape in ((71,), (35, 2), (1, 35, 2), (2, 1, 35), (70, 1)):
        with pytest.raises(ValueError, match="actions have the shape"):
            env.unwrapped.step(np.zeros(shape, np.float32))
    env.close()


def test_pixels_are_pixels_alone() -> None:
    env = make("Handover", obs_type="pixels", observation_width=np.int64(32), observation_height=24)
    assert set(env.observation_space.spaces) == {"pixels"}
    observation, _ = env.reset(seed=np.int64(2000))
    assert set(observation) == {"pixels"} and observation["pixels"]["A"].shape == (24, 32, 3)
    env.close()
