"""`inspect-robots` of the harness Inspect Robots runs Handover twice: with a policy of its own kind, and with its language model's agent.

    pip install -r tests/peers/harnesses/inspect_robots.txt
    pip install "./gateway/python[inspect-robots]"
    python tests/peers/harnesses/inspect_robots_run.py

The policy tells the robots what an expert told them in this episode, in chunks of 20 rows, and reaches
every phase. The model behind the agent is a script that names the expert's targets of every sixth row in a call of `move_joints`, and
stops once the bottle has been lifted.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
from inspect_robots import cli
from inspect_robots.policy import PolicyBase, PolicyInfo
from inspect_robots.registry import policy
from inspect_robots.spaces import ObservationSpace
from inspect_robots.types import Action, ActionChunk

from demonstration import SEED, TASK, rows
from inspect_robots_tandem import TandemEmbodiment

CHUNK = 20
KEYFRAME = 6
LIFTED_S = 5.0


def run(told, *flags):
    """The entry of the one episode in the command's log."""
    with tempfile.TemporaryDirectory() as logs:
        looks = ["-E", f"task={TASK}", "-E", f"look_every={CHUNK}", "-E", "renderer=cpu"]
        task = ["--task", "tandem", "-T", f"task={TASK}", "-T", f"seeds={SEED}"]
        status = cli.main(["run", *task, "--embodiment", "tandem", *looks, "--log-dir", logs, *flags])
        [log] = [json.loads(path.read_text()) for path in Path(logs).glob("*.json")]
    assert status == 0 and log["status"] == "success", (status, log)
    return log["results"]["metrics"]


def scripted(told):
    """A policy of the harness's own kind."""
    info = TandemEmbodiment(TASK).info

    class Scripted(PolicyBase):
        def __init__(self):
            observed = ObservationSpace(info.observation_space.cameras, state_keys=frozenset({"joint_pos"}))
            self.info = PolicyInfo("scripted", info.action_space, observed, 50.0)
            self.at = 0

        def reset(self, scene):
            self.at = 0

        def act(self, observation):
            assert observation.images.keys() == {"A", "B"} and observation.state["joint_pos"].shape == (70,)
            chunk = told[np.minimum(np.arange(self.at, self.at + CHUNK), len(told) - 1)]
            self.at += CHUNK
            return ActionChunk([Action(row.ravel()) for row in chunk], 50.0)

    return Scripted


class Model(BaseHTTPRequestHandler):
    """A model that answers like Chat Completions; `names` and `told` are set below."""

    protocol_version = "HTTP/1.1"
    asked = []

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["content-length"])))
        at = len(self.asked) * KEYFRAME
        self.asked.append(body)
        if at < LIFTED_S * 50:
            targets = dict(zip(self.names, np.round(self.told[at].ravel().astype(float), 4), strict=True))
            name, arguments = "move_joints", {"targets": targets, "note": "on to where the expert was"}
        else:
            name, arguments = "done", {"summary": "the bottle is lifted", "hindsight": "none"}
        call = {"id": f"call_{at}", "type": "function", "function": {"name": name, "arguments": json.dumps(arguments)}}
        message = {"role": "assistant", "content": None, "tool_calls": [call]}
        choice = {"index": 0, "message": message, "finish_reason": "tool_calls"}
        usage = {"prompt_tokens": 1, "completion_tokens": 1, "total_tokens": 2}
        answer = {"id": "c", "object": "chat.completion", "created": 0, "model": "m", "choices": [choice], "usage": usage}
        content = json.dumps(answer).encode()
        self.send_response(200)
        self.send_header("content-type", "application/json")
        self.send_header("content-length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *_):
        pass


def main():
    command = Path(sys.executable).parent / "inspect-robots"
    checked = subprocess.run([command, "doctor", "--embodiment", "tandem"], check=True, capture_output=True, text=True)
    print(checked.stdout.strip())
    with tempfile.TemporaryDirectory() as folder:
        told = rows(folder)
    policy("tandem_scripted")(scripted(told))
    metrics = run(told, "--policy", "tandem_scripted")
    print("policy:", metrics)
    assert (metrics["success_at_end"], metrics["tandem_phases"]) == (1.0, 3.0), metrics

    Model.told, Model.names = told, TandemEmbodiment(TASK).info.action_space.semantics.dim_labels
    server = ThreadingHTTPServer(("127.0.0.1", 0), Model)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    os.environ["SCRIPTED_KEY"] = "none"
    url = f"http://127.0.0.1:{server.server_port}/v1"
    agent = ["--policy", "agent", "-P", "model=scripted", "-P", f"base_url={url}", "-P", "api_key_env=SCRIPTED_KEY"]
    metrics = run(told, *agent)
    print("agent:", metrics, "after", len(Model.asked), "requests")
    assert metrics["tandem_phases"] >= 1.0, metrics


if __name__ == "__main__":
    main()
