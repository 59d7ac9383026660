"""Rollouts for a learner, by Ray's actors: each has a batch of worlds, and plays one candidate in each.

    pip install "./gateway/python[gym,ray]"
    python gateway/examples/environments/rollouts.py

The learner is the cross-entropy method. It searches for one pose of A's right arm in Handover, seven joint angles. Dense
rewards measure how near the pose brings the hand to holding the bottle. A policy gradient has the same shape: parameters go to the
actors, returns come back. In a larger cluster (RAY_ADDRESS), more actors use more machines.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import ray

from gym_tandem import TandemVectorEnv

SEED = 2000
COLUMNS = 35
PELVIS_HEIGHT_M = 0.74
RIGHT_ARM = slice(7, 14)
"""Columns of an action; `tandem.Episode.action_columns` names them."""
RIGHT_ARM_SEEN = slice(29, 36)
"""The same joints among the 43 of `agent_pos`."""
JOINTS = 7
SPREAD_RAD = 0.4
MIN_SPREAD_RAD = 0.03
ELITE_SHARE = 0.25


@ray.remote(num_cpus=1)
class Player:
    """A batch of worlds in one process; only parameters and returns are sent."""

    def __init__(self, worlds: int) -> None:
        self.envs = TandemVectorEnv("handover", worlds, threads=1, obs_type="state", reward_type="dense")

    def returns(self, poses_rad: Any, steps: int) -> Any:
        """Returns the return of each candidate: the arm moves to its pose in the first half of the steps, and stays there."""
        worlds = self.envs.num_envs
        seen, _ = self.envs.reset(seed=[SEED] * worlds)
        begun = seen["agent_pos"].reshape(worlds, 2, -1)[:, 0, RIGHT_ARM_SEEN].copy()
        rows = np.zeros((worlds, 2, COLUMNS), np.float32)
        rows[:, :, -1] = PELVIS_HEIGHT_M
        earned = np.zeros(worlds)
        for step in range(steps):
            share = min(1.0, 2 * (step + 1) / steps)
            rows[:, 0, RIGHT_ARM] = (1 - share) * begun + share * poses_rad
            earned += self.envs.step(rows.reshape(worlds, -1))[1]
        return earned


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, given in {"rounds": 10, "actors": 2, "worlds": 8, "steps": 100}.items():
        parser.add_argument(f"--{name}", type=int, default=given)
    given = parser.parse_args()
    ray.init(log_to_driver=False)
    players = [Player.remote(given.worlds) for _ in range(given.actors)]
    chance = np.random.default_rng(0)
    mean, spread = np.zeros(JOINTS), np.full(JOINTS, SPREAD_RAD)
    for number in range(1, given.rounds + 1):
        poses = chance.normal(mean, spread, (given.actors, given.worlds, JOINTS)).astype(np.float32)
        asked = [player.returns.remote(own, given.steps) for player, own in zip(players, poses, strict=True)]
        earned = np.concatenate(ray.get(asked))
        elite = np.argsort(earned)[-max(2, int(ELITE_SHARE * len(earned))) :]
        best = poses.reshape(-1, JOINTS)[elite]
        mean, spread = best.mean(axis=0), np.maximum(best.std(axis=0), MIN_SPREAD_RAD)
        print(f"round {number}: best return {earned.max():.3f}, mean {earned.mean():.3f}", flush=True)
    print("pose of A's right arm:", np.round(mean, 2).tolist())


if __name__ == "__main__":
    main()
