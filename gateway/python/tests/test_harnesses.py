"""Other projects' harnesses: their own checks, and an episode of each. Harnesses that are not installed are skipped."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tandem

gym = pytest.importorskip("gymnasium")
SIZE: dict[str, Any] = {"observation_width": 32, "observation_height": 24, "look_every": 10}


def held(state: np.ndarray[Any, np.dtype[Any]], columns: list[str]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """The row that keeps the robots in their present state, from a state with all joints."""
    names = [name for name in tandem._native.state_columns() if name.endswith("_joint_rad")] + columns[-4:]
    robots: np.ndarray[Any, np.dtype[Any]] = np.reshape(state, (2, -1))
    row = robots[:, [names.index(name) for name in columns]].astype(np.float32)
    row[:, -1] = 0.74
    return row.ravel()


def test_vla_eval_plays_its_benchmark() -> None:
    pytest.importorskip("vla_eval")
    # Modules that are typed only where the harness is installed.
    kind: Any = importlib.import_module("vla_eval_tandem").TandemBenchmark
    importlib.import_module("vla_eval.render").apply_render_mode(kind, "cpu", "tandem")
    benchmark = kind(seed=2003, **SIZE)
    tasks = benchmark.get_tasks()
    assert {"name": "handover", "suite": "tandem"} in tasks and len(tasks) == len(tandem.tasks().tasks)
    task: dict[str, Any] = {"name": "handover", "episode_idx": 0}
    first = benchmark.make_obs(benchmark.reset(task), task)
    assert {name: image.shape for name, image in first["images"].items()} == {"A": (24, 32, 3), "B": (24, 32, 3)}
    assert first["state"].shape == (94,) and first["states"] is first["state"]
    assert first["instructions"].keys() == {"A", "B"} and first["task_description"]
    # The next episode is different, and the first one begins again in the same state.
    other = benchmark.reset({**task, "episode_idx": 1})
    assert not np.array_equal(other["pixels"]["A"], first["images"]["A"])
    again = benchmark.make_obs(benchmark.reset(task), task)
    assert np.array_equal(again["images"]["A"], first["images"]["A"])

    row = held(first["state"], tandem._native.action_columns())
    stepped = benchmark.step({"actions": row})
    assert not benchmark.check_done(stepped)
    chunk = benchmark.step({"actions": np.stack([row] * 2000)})
    assert benchmark.check_done(chunk), "the budget ends it within the chunk"
    result = benchmark.get_step_result(chunk)
    assert result == {"success": False, "phases": 0, "p1": False, "p2": False, "p3": False}
    assert benchmark.get_metric_keys().keys() == result.keys()
    with pytest.raises(ValueError, match=r"handover takes \(70,\)"):
        benchmark.step({"actions": np.zeros(7)})
    benchmark.cleanup()


def test_inspect_robots_finds_its_embodiment_conformant() -> None:
    pytest.importorskip("inspect_robots")
    from inspect_robots.conformance import assert_embodiment_conformant
    from inspect_robots.registry import resolve

    for told in tandem.tasks().tasks:
        embodiment = resolve("embodiment", "tandem", task=told.id)
        assert_embodiment_conformant(embodiment.info)
        assert all(robot.instruction in embodiment.info.docs for robot in told.robots)
        embodiment.close()
    with pytest.raises(ValueError, match="no task 'handove'; have: "):
        resolve("embodiment", "tandem", task="handove")


def test_inspect_robots_evaluates_episodes_by_their_seeds(tmp_path: Path) -> None:
    pytest.importorskip("inspect_robots")
    from inspect_robots import eval as evaluate
    from inspect_robots.policy import PolicyBase, PolicyInfo
    from inspect_robots.registry import resolve
    from inspect_robots.types import Action, ActionChunk, Observation

    embodiment = resolve("embodiment", "tandem", **SIZE)
    info = embodiment.info

    class Still(PolicyBase):
        """Keeps the robots in the first observed state."""

        info = PolicyInfo("still", embodiment.info.action_space, embodiment.info.observation_space, 50.0)
        began: list[Observation] = []  # noqa: RUF012

        def reset(self, scene: Any) -> None:
            self.row: Any = None

        def act(self, observation: Observation) -> ActionChunk:
            if self.row is None:
                self.began.append(observation)
                self.row = np.array(observation.state["joint_pos"])
                self.row[34::35] = 0.74
            return ActionChunk([Action(self.row)] * 50, 50.0)

    task = resolve("task", "tandem", seeds="2003-2004")
    assert [scene.init_seed for scene in task.scenes] == [2003, 2004]
    policy = Still()
    task.epochs, task.max_steps = 2, 60
    (log,) = evaluate(task, policy, embodiment, log_dir=str(tmp_path))
    assert log.status == "success"
    assert log.results.metrics == {"success_at_end": 0.0, "tandem_phases": 0.0}
    state = [seen.state["joint_pos"] for seen in policy.began]
    pictures = [seen.images["A"] for seen in policy.began]
    assert len(state) == 4 and state[0].shape == info.action_space.shape
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[2], pictures[3])
    assert not np.array_equal(pictures[0], pictures[2])
    with pytest.raises(ValueError, match="give one, for example 2000, or a range"):
        resolve("task", "tandem", seeds="all")
    embodiment.close()


def test_openenv_steps_by_tools() -> None:
    pytest.importorskip("openenv")
    module: Any = importlib.import_module("openenv_tandem")
    running = module.TandemEnvironment()
    begun = running.reset(seed=2000)
    with pytest.raises(tandem.TandemError):
        running.reset(task="handove")
    assert begun.reply and running.step(module.TandemAction(tool="get_status")).problem is None, "it goes on"
    running.close()
    env, action = module.TandemEnvironment(), module.TandemAction
    with pytest.raises(RuntimeError, match="call reset first"):
        env.step(action(tool="observe"))
    began = env.reset(task="handover", seed=2003)
    assert began.reply["brief"] and (began.reward, began.done) == (0.0, False)
    assert (env.state.task, env.state.seed, env.state.ended) == ("handover", 2003, None)
    steps = env.state.step_count
    waited = env.step(action(tool="wait", arguments={"steps": 5}))
    assert waited.reply["executed_steps"] == 5 and env.state.step_count == steps + 5
    refused = env.step(action(tool="wave"))
    assert refused.reply is None and 'no tool "wave"; have: observe' in refused.problem
    ended = env.step(action(tool="finish"))
    assert ended.done and ended.reward == 0.0 and ended.result["ended"] == env.state.ended == "finished"
    after = env.step(action(tool="wait", arguments={"steps": 5}))
    assert after.done and after.problem
    assert env.step(action(tool="finish")).reward == 0.0
    # The next episode is the next seed's.
    env.reset()
    assert env.state.seed == 2004
    with pytest.raises(ValueError, match="no setting sead; have: task, seed"):
        env.reset(sead=3)
    env.close()
