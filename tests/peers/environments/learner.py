"""Stable-Baselines3 checks an environment, and learns in one for 10,000 steps.

    pip install -r tests/peers/environments/learner.txt
    pip install "./gateway/python[gym]"
    python tests/peers/environments/learner.py

It is no claim that anything is learned in so few steps: everything a learner asks of an environment is asked, episodes end and
begin anew, and what comes back stays finite.
"""

import gymnasium as gym
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import gym_tandem

STEPS = 10_000
WORLDS = 2


def make():
    """Handover without pictures; actions from -1 to 1 are the joints' ranges."""
    env = gym.make("gym_tandem/Handover-v0", obs_type="state", reward_type="dense")
    return gym.wrappers.RescaleAction(env, np.float32(-1.0), np.float32(1.0))


def main():
    check_env(make(), skip_render_check=True)
    envs = VecMonitor(DummyVecEnv([make] * WORLDS))
    learner = PPO("MultiInputPolicy", envs, n_steps=500, batch_size=250, n_epochs=4, seed=1, verbose=1, device="cpu")
    learner.learn(STEPS)
    episodes = list(learner.ep_info_buffer)
    returns = [episode["r"] for episode in episodes]
    assert learner.num_timesteps >= STEPS, learner.num_timesteps
    assert episodes and np.isfinite(returns).all() and max(returns) <= 3.0, returns
    seen = envs.reset()
    action, _ = learner.predict(seen, deterministic=True)
    assert action.shape == (WORLDS, 70) and np.isfinite(action).all()
    print(f"{learner.num_timesteps} steps, the last {len(episodes)} episodes with a mean return of {np.mean(returns):.3f}")
    print(f"environments: {', '.join(sorted(name for name in gym.registry if name.startswith(gym_tandem.__name__)))}")


if __name__ == "__main__":
    main()
