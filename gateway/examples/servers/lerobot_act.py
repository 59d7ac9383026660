"""Serves a LeRobot policy as `/act` for Tandem. It runs where `lerobot` is installed.

    python3 gateway/examples/servers/lerobot_act.py --policy USER/POLICY --device cuda --port 8001
    tandem evaluate --policy act:http://127.0.0.1:8001/act --policy-map lerobot.toml --protocol benchmark

The map has the images, states and actions on which the policy was trained, under LeRobot's own keys:

    preset = "openpi"
    [images]
    "observation.images.front" = { camera = "egocentric", size = [640, 480], fit = "stretch" }
    [state]
    "observation.state" = ["left_arm", "right_arm"]
    [prompt]
    "task" = "text"
    [action]
    "action" = ["left_arm", "right_arm"]
    [chunk]
    rate_hz = 30.0

It is for policies that use only the present observation, for example ACT, pi0.5 and SmolVLA. It does not serve policies that
combine several moments, for example diffusion policies, because one server answers all robots and worlds in turn.
"""

import argparse
import base64
import http.server
import json
import threading

import numpy as np


def load(name, device):
    """Returns a function from observations under LeRobot's keys to rows of actions."""
    import torch
    from lerobot.configs.policies import PreTrainedConfig
    from lerobot.policies.factory import get_policy_class, make_pre_post_processors
    from lerobot.policies.utils import prepare_observation_for_inference

    config = PreTrainedConfig.from_pretrained(name)
    if config.n_obs_steps > 1:
        raise SystemExit(f"{name} looks at {config.n_obs_steps} moments together; serve a policy that looks at one")
    policy = get_policy_class(config.type).from_pretrained(name).to(device).eval()
    on_device = {"device_processor": {"device": device}}
    before, after = make_pre_post_processors(policy.config, pretrained_path=name, preprocessor_overrides=on_device)

    @torch.inference_mode()
    def infer(observation):
        task = observation.pop("task", "")
        chunk = policy.predict_action_chunk(before(prepare_observation_for_inference(observation, torch.device(device), task)))
        return {"action": [after(row)[0].tolist() for row in chunk.unbind(dim=1)]}

    return infer


def from_json(entry):
    """Decodes arrays of Tandem; they are writable, as LeRobot requires."""
    if "__numpy__" in entry:
        return np.frombuffer(base64.b64decode(entry["__numpy__"]), entry["dtype"]).reshape(entry["shape"]).copy()
    return entry


def handler(infer):
    # A policy is one model, which answers one request after another.
    one_by_one = threading.Lock()

    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        disable_nagle_algorithm = True

        def do_POST(self):
            body = self.rfile.read(int(self.headers["content-length"]))
            try:
                observation = json.loads(body, object_hook=from_json)
                with one_by_one:
                    status, answer = 200, json.dumps(infer(observation))
            except Exception as error:
                status, answer = 500, f"{type(error).__name__}: {error}"
            answer = answer.encode()
            self.send_response(status)
            self.send_header("content-type", "application/json" if status == 200 else "text/plain")
            self.send_header("content-length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_):
            pass

    return Handler


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--policy", required=True, help="a folder, or a name on the Hub")
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--port", type=int, default=8001)
    args = parser.parse_args()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", args.port), handler(load(args.policy, args.device)))
    print(f"http://127.0.0.1:{server.server_port}/act answers by {args.policy}", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
