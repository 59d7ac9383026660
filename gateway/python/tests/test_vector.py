"""Many episodes as one environment."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

gym = pytest.importorskip("gymnasium")

FALLING = np.zeros((2, 35), np.float32)
"""Actions under which every robot falls."""
FALLING[:, -4:] = -0.4, 0.4, 0.6, 0.4
FALLING[:, [28, 30]] = 2.0, 0.5


def make(number: int, **settings: Any) -> Any:
    import gym_tandem  # noqa: F401  # pyright: ignore[reportUnusedImport]

    return gym.make_vec("gym_tandem/Handover-v0", num_envs=number, **{"obs_type": "state", **settings})


def standing(number: int) -> NDArray[np.float32]:
    rows = np.zeros((number, 70), np.float32)
    rows[:, [34, 69]] = 0.74
    return rows


def test_worlds_are_the_environments_one_by_one() -> None:
    import gym_tandem

    envs = make(3, threads=2)
    assert envs.metadata["autoreset_mode"] == gym.vector.AutoresetMode.NEXT_STEP
    seen, infos = envs.reset(seed=2010)
    assert infos["seed"].tolist() == [2010, 2011, 2012]
    assert envs.observation_space.contains(seen)
    actions = standing(3)
    actions[1, 3] = 0.5
    for _ in range(9):
        envs.step(actions)
    seen, rewards, terminated, truncated, infos = envs.step(actions)
    assert rewards.shape == terminated.shape == truncated.shape == (3,)
    for world in range(3):
        env = gym_tandem.TandemEnv("handover", obs_type="state")
        env.reset(seed=2010 + world)
        alone = [env.step(actions[world])[0] for _ in range(10)][-1]
        assert np.array_equal(seen["agent_pos"][world], alone["agent_pos"])
        assert envs.state_hashes()[world] == env.state_hash()
    before = seen["agent_pos"].copy()
    envs.step(actions)
    assert np.array_equal(seen["agent_pos"], before)
    assert envs.call("_max_episode_steps") == (1000,) * 3
    envs.close()


def ends(envs: Any) -> tuple[list[int], dict[str, Any], Any]:
    """Lets the robots of world 0 fall. Returns the seeds of the last step, its infos, and the observations."""
    actions = standing(envs.num_envs)
    actions[0] = FALLING.ravel()
    for _ in range(400):
        seen, _, terminated, _, infos = envs.step(actions)
        if terminated[0]:
            return infos["seed"].tolist(), infos, seen
    raise AssertionError("nobody has fallen")


def test_the_next_episode_begins_in_the_next_step() -> None:
    envs = make(2)
    envs.reset(seed=2000)
    seeds, infos, _ = ends(envs)
    assert (seeds, infos["fallen"][0].any(), "final_obs" in infos) == ([2000, 2001], np.True_, False)
    seen, rewards, terminated, _, infos = envs.step(standing(2))
    assert (infos["seed"].tolist(), rewards[0], bool(terminated[0])) == ([2002, 2001], 0.0, False)
    begun = seen["agent_pos"][0].copy()
    # The next round follows, regardless of the number of automatic starts.
    _, infos = envs.reset()
    assert infos["seed"].tolist() == [2002, 2003]
    seen, _ = envs.reset(seed=[2002, 7])
    assert np.array_equal(seen["agent_pos"][0], begun)
    envs.close()


def test_the_next_episode_begins_in_the_same_step() -> None:
    envs = make(2, autoreset_mode="SameStep")
    assert envs.metadata["autoreset_mode"] == gym.vector.AutoresetMode.SAME_STEP
    envs.reset(seed=2000)
    seeds, infos, seen = ends(envs)
    assert seeds == [2002, 2001]
    assert infos["_final_obs"].tolist() == [True, False]
    assert infos["final_info"]["seed"][0] == 2000
    assert infos["final_info"]["fallen"][0].any()
    assert not infos["fallen"][0].any()
    last = infos["final_obs"][0]
    assert envs.single_observation_space.contains(last)
    assert np.abs(last["agent_pos"] - seen["agent_pos"][0]).max() > 0.1
    envs.close()


def test_worlds_are_reset_one_by_one() -> None:
    envs = make(2, autoreset_mode="Disabled")
    envs.reset(seed=2000)
    ends(envs)
    with pytest.raises(Exception, match="world 0 has no episode under way"):
        envs.step(standing(2))
    before = envs.state_hashes()
    _, infos = envs.reset(seed=[2005, None], options={"reset_mask": np.array([True, False])})
    assert (infos["seed"][0], infos["_seed"].tolist()) == (2005, [True, False])
    assert envs.state_hashes()[1] == before[1]
    envs.step(standing(2))
    envs.close()


def test_pictures_of_a_batch() -> None:
    envs = make(
        2, obs_type="pixels_agent_pos", observation_width=32, observation_height=32, renderer="cpu", render_mode="rgb_array"
    )
    seen, _ = envs.reset(seed=2000)
    assert seen["pixels"]["A"].shape == (2, 32, 32, 3)
    assert envs.observation_space.contains(seen)
    assert [picture.shape for picture in envs.render()] == [(32, 64, 3)] * 2
    assert np.array_equal(envs.render()[1][:, 32:], seen["pixels"]["B"][1])
    envs.close()


PLAYS = """
import sys, numpy as np, gymnasium as gym, gym_tandem
envs = gym.make_vec("gym_tandem/Handover-v0", num_envs=2, obs_type="state", record=sys.argv[1])
envs.reset(seed=2000)
rows = np.zeros((2, 2, 35), np.float32)
rows[:, :, -1] = 0.74
steps = 0
try:
    while True:
        envs.step(rows)
        steps += 1
        if steps == 20:
            print("playing", flush=True)
except KeyboardInterrupt:
    envs.step(rows)
    print("interrupted", flush=True)
    raise
"""


def test_an_interrupt_leaves_recordings_whole(tmp_path: Path) -> None:
    import tandem

    with subprocess.Popen(
        [sys.executable, "-c", PLAYS, "runs"], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as player:
        assert player.stdout is not None
        assert player.stdout.readline() == "playing\n"
        time.sleep(0.1)
        player.send_signal(signal.SIGINT)
        said, _ = player.communicate(timeout=120)
    assert said == "interrupted\n"
    folders = sorted((tmp_path / "runs").iterdir())
    assert [folder.name for folder in folders] == ["handover-world0-seed2000", "handover-world1-seed2001"]
    for folder in folders:
        result: Any = tandem.Recording(folder).result
        assert result.env_steps >= 21
        replay = [sys.executable, "-m", "tandem", "replay", str(folder / "episode.mcap"), "--verify"]
        verified = subprocess.run(replay, cwd=tmp_path, check=False)
        assert verified.returncode == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_leaves_its_parents_files_alone(tmp_path: Path) -> None:
    import tandem

    envs = make(2, record=tmp_path)
    envs.reset(seed=2000)
    with tandem.Episode("handover", 2000, record=tmp_path / "alone") as episode:
        child = os.fork()
        if child == 0:
            # The number of refusals is the exit code of the child.
            refused = 0
            for asked in (lambda: envs.step(standing(2)), lambda: episode.wait(1)):
                try:
                    asked()
                except tandem.TandemError as error:
                    refused += "fork" in str(error)
            envs.close()
            del envs, episode
            os._exit(refused)
        _, status = os.waitpid(child, 0)
        assert os.waitstatus_to_exitcode(status) == 2
        episode.wait(5)
        alone = episode.finish()
    envs.step(standing(2))
    envs.close()
    for folder, steps in (("handover-world0-seed2000", 1), ("handover-world1-seed2001", 1), ("alone", alone.env_steps)):
        result: Any = tandem.Recording(tmp_path / folder).result
        assert result.env_steps == steps
