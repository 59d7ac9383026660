"""Plays an episode by a policy of LeRobot's own package, an ACT whose weights have not learned anything, behind
`gateway/examples/servers/lerobot_act.py`.

    pip install -r tests/peers/environments/lerobot_act.txt         (Python 3.10 or 3.11)
    pip install ./gateway/python
    python tests/peers/environments/lerobot_act.py

What LeRobot's `select_action` says to the first observation of each robot is what the server answered, and the rows that were
answered are what the robots were told.
"""

import importlib.util
import json
import subprocess
import sys
import tempfile
import threading
from http.server import ThreadingHTTPServer
from pathlib import Path

import numpy as np
import torch
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from lerobot.policies.utils import prepare_observation_for_inference

import tandem

SERVER = Path(__file__).resolve().parents[3] / "gateway/examples/servers/lerobot_act.py"
ROWS = 50
EYES, STATE, ACTION = "observation.images.front", "observation.state", "action"
ARMS = 14
MAP = f"""preset = "openpi"
[images]
"{EYES}" = {{ camera = "egocentric", size = [160, 120], fit = "stretch" }}
[state]
"{STATE}" = ["left_arm", "right_arm"]
[prompt]
"task" = "text"
[action]
"{ACTION}" = ["left_arm", "right_arm"]
[chunk]
rows = {ROWS}
rate_hz = 50.0
"""


def save_fresh_policy(folder):
    """An ACT in the form that LeRobot saves. Its actions are close to arms at rest."""
    torch.manual_seed(0)
    config = ACTConfig(
        input_features={
            EYES: PolicyFeature(FeatureType.VISUAL, (3, 120, 160)),
            STATE: PolicyFeature(FeatureType.STATE, (ARMS,)),
        },
        output_features={ACTION: PolicyFeature(FeatureType.ACTION, (ARMS,))},
        chunk_size=ROWS,
        n_action_steps=ROWS,
        dim_model=64,
        n_heads=2,
        dim_feedforward=128,
        pretrained_backbone_weights=None,
        device="cpu",
    )
    near = {"mean": torch.zeros(ARMS), "std": torch.full((ARMS,), 0.05)}
    of_pixels = {"mean": torch.full((3, 1, 1), 0.5), "std": torch.full((3, 1, 1), 0.25)}
    before, after = make_pre_post_processors(config, dataset_stats={EYES: of_pixels, STATE: near, ACTION: near})
    policy = ACTPolicy(config)
    for part in (policy, before, after):
        part.save_pretrained(folder)
    return policy.eval(), before, after


def serve(folder, asked):
    """The example's server. Its requests and answers are stored."""
    spec = importlib.util.spec_from_file_location("lerobot_act_server", SERVER)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    infer = example.load(str(folder), "cpu")

    def kept(observation):
        shown = {key: value.copy() if isinstance(value, np.ndarray) else value for key, value in observation.items()}
        answer = infer(observation)
        asked.append((shown, np.array(answer["action"])))
        return answer

    server = ThreadingHTTPServer(("127.0.0.1", 0), example.handler(kept))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"act:http://127.0.0.1:{server.server_port}/act"


def main():
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as scratch:
        scratch, asked = Path(scratch), []
        policy, before, after = save_fresh_policy(scratch / "policy")
        (scratch / "map.toml").write_text(MAP)
        flags = ["--policy", serve(scratch / "policy", asked), "--policy-map", scratch / "map.toml", "--protocol", "benchmark"]
        flags += ["--tasks", "handover", "--seeds", "2000", "--record", "--out", scratch / "out"]
        subprocess.run([sys.executable, "-m", "tandem", "evaluate", *map(str, flags)], check=True)
        (episode,) = json.loads((scratch / "out/results.json").read_text())["episodes"]
        assert (episode["ended"], episode["env_steps"]) == ("step_budget_exhausted", 1000), episode
        recording = tandem.Recording(scratch / "out/episodes/handover-2000")
    played = [entry for entry in asked if entry[0][EYES].any()]
    assert len(played) == 2 * 1000 // ROWS, len(played)
    for robot, (shown, answer) in enumerate(played[:2]):
        assert shown["task"] == list(recording.instructions.values())[robot]
        policy.reset()
        task = shown.pop("task")
        with torch.inference_mode():
            first = after(policy.select_action(before(prepare_observation_for_inference(shown, torch.device("cpu"), task))))
        assert np.allclose(first[0].numpy(), answer[0], atol=1e-5), "LeRobot says something else itself"
    worst_rad = 0.0
    for number, (_, answer) in enumerate(played):
        begin = 1 + number // 2 * ROWS
        told = recording.actions[begin : begin + ROWS, number % 2, :ARMS]
        worst_rad = max(worst_rad, np.abs(told - answer).max())
    assert worst_rad < 1e-5, worst_rad
    print(f"lerobot    {len(played)} requests to ACT, as LeRobot answers itself; robots were told these rows")


if __name__ == "__main__":
    main()
