"""LeRobot's own `lerobot-eval` plays Handover through `lerobot_env_tandem`, and its rollout the environments of an EnvHub `env.py`.

    pip install -r tests/peers/environments/lerobot_eval.txt
    pip install "./gateway/python[lerobot]"
    python tests/peers/environments/lerobot_eval.py

The policy is an ACT of random weights: what is tried is that everything that LeRobot asks of an environment is there, that
features fit, that films are written, and that the same seeds begin the same episodes however soon others end.
"""

import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from lerobot.envs.factory import make_env_pre_post_processors
from lerobot.envs.utils import _call_make_env, _load_module_from_path, _normalize_hub_result
from lerobot.policies.factory import make_policy, make_policy_config, make_pre_post_processors
from lerobot.scripts.lerobot_eval import rollout

from lerobot_env_tandem import TandemEnvConfig

REPOSITORY = Path(__file__).resolve().parents[3]
SIZE = {"observation_width": 64, "observation_height": 64, "look_every": 20}
ACT = {"dim_model": 64, "n_heads": 2, "dim_feedforward": 128, "chunk_size": 20, "n_action_steps": 20}
WORLDS = 2


def flags(prefix, settings):
    return [f"--{prefix}.{name}={value}" for name, value in settings.items()]


def by_command():
    """The command itself: two episodes of Handover, side by side."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            Path(sys.executable).parent / "lerobot-eval",
            "--env.discover_packages_path=lerobot_env_tandem",
            "--env.type=tandem",
            "--env.task=Handover-v0",
            *flags("env", SIZE),
            "--policy.type=act",
            "--policy.device=cpu",
            "--policy.push_to_hub=false",
            "--policy.pretrained_backbone_weights=null",
            *flags("policy", ACT),
            f"--eval.n_episodes={WORLDS}",
            f"--eval.batch_size={WORLDS}",
            f"--output_dir={folder}",
            "--seed=2000",
        ]
        subprocess.run(command, check=True)
        told = json.loads((Path(folder) / "eval_info.json").read_text())
        films = list(Path(folder).rglob("*.mp4"))
    overall = told["overall"]
    assert overall["n_episodes"] == WORLDS, overall
    assert len(films) == WORLDS and overall["pc_success"] == 0.0, (films, overall)
    print("lerobot-eval:", overall)


def by_hub():
    """The file of a repository of the hub, loaded and called like in LeRobot."""
    config = TandemEnvConfig(task="Handover-v0", **SIZE)
    module = _load_module_from_path(str(REPOSITORY / "gateway/examples/environments/env.py"))
    suites = _normalize_hub_result(_call_make_env(module, n_envs=WORLDS, use_async_envs=False, cfg=config))
    policy_config = make_policy_config("act", device="cpu", pretrained_backbone_weights=None, push_to_hub=False, **ACT)
    policy = make_policy(policy_config, env_cfg=config)
    policy.eval()
    around_env = make_env_pre_post_processors(env_cfg=config, policy_cfg=policy_config)
    around_policy = make_pre_post_processors(policy_cfg=policy_config)
    envs = suites["tandem"][0]
    began = []
    reset = envs.reset

    def noted(**arguments):
        seen, infos = reset(**arguments)
        began.append((infos["seed"].tolist(), seen["agent_pos"].copy()))
        return seen, infos

    envs.reset = noted
    for seeds in ([2000, 2001], [2002, 2003], [2000, 2001]):
        played = rollout(envs, policy, *around_env, *around_policy, seeds=seeds)
        assert played["done"][:, -1].all()
    assert [seeds for seeds, _ in began] == [[2000, 2001], [2002, 2003], [2000, 2001]]
    assert np.array_equal(began[0][1], began[2][1])
    print("EnvHub:", {suite: [type(env).__name__ for env in of.values()] for suite, of in suites.items()})
    for env in suites["tandem"].values():
        env.close()


if __name__ == "__main__":
    assert importlib.util.find_spec("lerobot_env_tandem")
    by_command()
    by_hub()
