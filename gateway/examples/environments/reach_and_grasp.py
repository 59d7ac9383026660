"""Reinforcement learning: A's right hand learns to reach for Handover's bottle, to close on it and to lift it.

    pip install -r gateway/examples/environments/reach_and_grasp.txt
    pip install "./gateway/python[gym]"
    python gateway/examples/environments/reach_and_grasp.py --out runs/reach_and_grasp

Proximal policy optimisation of Stable-Baselines3, from scratch, on the native vector environment and with its dense rewards: no
demonstration, no expert. Five times a second the policy chooses the direction of the wrist and whether the hand opens
or closes; the hand stays level. It senses its own arm and fingers and sees no image. `curve.csv` has a line for each rollout.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

import tandem
from gym_tandem import TandemVectorEnv

FIRST_SEED, FIRST_UNSEEN_SEED = 2000, 1_000_000
UNSEEN_ROUNDS = 6
"""Episodes in each world that are played in the end."""
DECISION_STEPS = 10
"""Control steps of 20 ms from one decision to the next."""
DECISIONS = 16
MOVE_M = 0.04
"""Farthest that the wrist's target goes in one decision, along each axis of the pelvis frame."""
REACH_M = np.array([[0.05, -0.30, 0.08], [0.24, -0.10, 0.35]])
"""Where the target stays: above the counter, and in reach."""
CLOSE = 0.35
"""Most that the hand opens or closes in one decision, of all the way."""
OPEN_RAD = np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
CLOSED_RAD = np.array([0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3])
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])

ROW = 32
RIGHT_WRIST, RIGHT_FINGERS = slice(7, 14), slice(21, 28)
"""In a row of `action_type="wrists"`: left and right wrist, left and right fingers, base command."""
ARM_SEEN = slice(29, 43)
"""Joints of the right arm and hand among the 43 of `agent_pos`."""


class ReachAndGrasp(VecEnv):
    """Handover's first phase as an environment of its own, in all worlds at once."""

    def __init__(self, worlds: int, threads: int, seed: int) -> None:
        rewarded = {"obs_type": "state", "action_type": "wrists", "reward_type": "dense", "autoreset_mode": "Disabled"}
        self.envs = TandemVectorEnv("handover", worlds, threads=threads, **rewarded)
        seen = gym.spaces.Box(-np.inf, np.inf, (5 + ARM_SEEN.stop - ARM_SEEN.start,), np.float32)
        super().__init__(worlds, seen, gym.spaces.Box(-1.0, 1.0, (4,), np.float32))
        self.first_seed = seed
        self.rows = begun_rows()
        self.begun_m = self.rows[0, RIGHT_WRIST][:3].copy()
        self.target_m, self.closed = np.tile(self.begun_m, (worlds, 1)), np.zeros(worlds)
        self.decision, self.agent_pos = np.zeros(worlds, int), np.zeros((worlds, 0))
        self.actions = np.zeros((worlds, 4))

    def reset(self) -> Any:
        self.agent_pos = self.envs.reset(seed=self.first_seed)[0]["agent_pos"]
        self.begin(np.ones(self.num_envs, bool))
        return self.seen()

    def begin(self, those: Any) -> None:
        self.target_m[those], self.closed[those], self.decision[those] = self.begun_m, 0.0, 0

    def seen(self) -> Any:
        arm = self.agent_pos.reshape(self.num_envs, 2, -1)[:, 0, ARM_SEEN]
        offset = 10 * (self.target_m - self.begun_m)
        told = [self.closed[:, None], self.decision[:, None] / DECISIONS]
        return np.concatenate([offset, *told, arm], axis=1).astype(np.float32)

    def step_async(self, actions: Any) -> None:
        self.actions = actions

    def step_wait(self) -> Any:
        before = self.target_m.copy(), self.closed.copy()
        self.target_m = np.clip(self.target_m + MOVE_M * self.actions[:, :3], *REACH_M)
        self.closed = np.clip(self.closed + CLOSE * self.actions[:, 3], 0.0, 1.0)
        rewards, grasped = np.zeros(self.num_envs), np.zeros(self.num_envs, bool)
        over = np.zeros(self.num_envs, bool)
        for step in range(DECISION_STEPS):
            share = (step + 1) / DECISION_STEPS
            between = [(1 - share) * old + share * new for old, new in zip(before, (self.target_m, self.closed), strict=True)]
            seen, earned, terminated, truncated, infos = self.envs.step(self.row(*between))
            # Later phases are not part of the environment.
            rewards += np.where(grasped, 0.0, earned)
            grasped |= infos["phases"] >= 1
            over |= terminated | truncated
            if over.any():
                break
        self.agent_pos = seen["agent_pos"]
        self.decision += 1
        out_of_time = self.decision >= DECISIONS
        done = grasped | over | out_of_time
        last = self.seen()
        told: list[dict[str, Any]] = [{"grasped": bool(one)} for one in grasped]
        for world in np.flatnonzero(done):
            truncated_by_us = bool(not grasped[world] and not over[world])
            told[world] |= {"terminal_observation": last[world], "TimeLimit.truncated": truncated_by_us}
        if done.any():
            self.agent_pos = self.envs.reset(options={"reset_mask": done})[0]["agent_pos"]
            self.begin(done)
        return self.seen(), rewards.astype(np.float32), done, told

    def row(self, target_m: Any, closed: Any) -> Any:
        rows = np.tile(self.rows, (self.num_envs, 1, 1))
        rows[:, 0, RIGHT_WRIST] = np.concatenate([target_m, np.tile(LEVEL, (self.num_envs, 1))], axis=1)
        rows[:, 0, RIGHT_FINGERS] = OPEN_RAD + closed[:, None] * (CLOSED_RAD - OPEN_RAD)
        return rows.reshape(self.num_envs, -1).astype(np.float32)

    def close(self) -> None:
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        setattr(self, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        return [getattr(self, method_name)(*args, **kwargs)] * self.num_envs

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


def begun_rows() -> Any:
    """Returns rows that hold both robots in their initial postures."""
    rows = np.zeros((2, ROW))
    with tandem.Episode("handover", FIRST_SEED, protocol="benchmark") as episode:
        columns, state = list(episode.state_columns), episode.state()
    left = columns.index("left_wrist_x_m")
    rows[:, :14] = state[:, left : left + 14]
    rows[:, -1] = state[:, columns.index("pelvis_height_m")]
    return rows


class Curve(BaseCallback):
    """Writes a line for each rollout, about the episodes that ended in it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path, self.begun_s, self.ended = path, time.process_time(), []

    def _on_step(self) -> bool:
        self.ended += [(told["episode"]["r"], told["grasped"]) for told in self.locals["infos"] if "episode" in told]
        return True

    def _on_rollout_end(self) -> None:
        if not self.ended:
            return
        returns, grasps = np.array(self.ended, float).T
        line = [self.num_timesteps, round(time.process_time() - self.begun_s), len(self.ended), returns.mean(), grasps.mean()]
        with self.path.open("a", encoding="utf-8") as file:
            csv.writer(file).writerow([*line[:3], *(f"{number:.3f}" for number in line[3:])])
        told = "{} decisions, {} s of processor time: {} episodes, mean return {:.3f}, lifted in {:.0%}"
        print(told.format(*line), flush=True)
        self.ended = []


def lifted(learner: PPO, envs: ReachAndGrasp, seeds: range) -> int:
    """Returns the number of episodes of these unseen seeds in which the bottle is lifted, with deterministic actions."""
    count = 0
    for first_seed in seeds[:: envs.num_envs]:
        envs.first_seed = first_seed
        seen, begun = envs.reset(), np.ones(envs.num_envs, bool)
        while begun.any():
            seen, _, done, told = envs.step(learner.predict(seen, deterministic=True)[0])
            count += sum(one["grasped"] for one, counts in zip(told, begun & done, strict=True) if counts)
            begun &= ~done
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, given in {"decisions": 24_576, "worlds": 16, "threads": 1, "seed": 0}.items():
        parser.add_argument(f"--{name}", type=int, default=given)
    parser.add_argument("--out", type=Path, default=Path("runs/reach_and_grasp"))
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    curve = given.out / "curve.csv"
    curve.write_text("decisions,processor_s,episodes,mean_return,lifted_share\n", encoding="utf-8")
    envs = ReachAndGrasp(given.worlds, given.threads, FIRST_SEED)
    shape = {"net_arch": [64, 64], "log_std_init": -0.5}
    learner = PPO(
        "MlpPolicy",
        VecMonitor(envs),
        n_steps=64,
        batch_size=256,
        n_epochs=10,
        gamma=0.98,
        learning_rate=1e-3,
        policy_kwargs=shape,
        seed=given.seed,
        device="cpu",
    )
    learner.learn(given.decisions, Curve(curve))
    learner.save(given.out / "policy.zip")
    unseen = range(FIRST_UNSEEN_SEED, FIRST_UNSEEN_SEED + UNSEEN_ROUNDS * given.worlds)
    print(f"lifted in {lifted(learner, envs, unseen)} of {len(unseen)} unseen episodes")


if __name__ == "__main__":
    main()
