"""Plays Handover by a policy behind XPolicyLab's wire format. Frames are read and written by the package inspect-robots-xpolicylab, whose
own client is tried on the same server first; the server does with them what XPolicyLab's `model_server` does. XPolicyLab itself is on no
package registry.

    pip install -r tests/peers/policies/xpolicylab.txt
    pip install ./gateway/python
    cargo build --release
    python tests/peers/policies/xpolicylab.py target/release/tandem

The policy tells the robots what an expert told them in this episode, arms and hands alone, in chunks of 20 rows.
"""

import json
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import websockets.sync.server
from inspect_robots_xpolicylab._client import PolicyClient
from inspect_robots_xpolicylab._protocol import Frame, MessageType, decode_frame, encode_frame

from arm_raise import tandem_of_command_line

sys.path.append(str(Path(__file__).resolve().parents[1] / "harnesses"))
from demonstration import SEED, TASK, rows

CHUNK = 20
THINKS_S = 12.0
PARTS = {"left_arm_joint_state": 0, "right_arm_joint_state": 7, "left_ee_joint_state": 14, "right_ee_joint_state": 21}


class Model:
    """A model like XPolicyLab's, with `reset`, `update_obs` and `get_action`. It serves all robots, and their instructions identify them."""

    def __init__(self, told, thinks_s=0.0):
        self.told, self.looks, self.resets, self.thinks_s = told, {}, 0, thinks_s

    def reset(self):
        self.resets += 1
        self.looks = {}

    def update_obs(self, observation):
        assert observation["data_format_version"] == "v1.0"
        color = observation["vision"]["cam_head"]["color"]
        assert (color.shape, color.dtype) == ((240, 320, 3), np.uint8)
        assert observation["state"]["left_ee_pose"].shape == (7,)
        self.words = observation["instruction"]

    def get_action(self):
        robot = 0 if "Take the bottle" in self.words else 1
        look = self.looks[robot] = self.looks.get(robot, -1) + 1
        time.sleep(self.thinks_s if look == 1 else 0.0)
        at = np.minimum(np.arange(look * CHUNK, (look + 1) * CHUNK), len(self.told) - 1)
        return [{part: row[begin : begin + 7] for part, begin in PARTS.items()} for row in self.told[at, robot]]


def answer(model, frame):
    """The kind and the payload of an answer."""
    match frame.message_type:
        case MessageType.RESET:
            model.reset()
            return MessageType.RESET_RESULT, {"ok": True}
        case MessageType.INFER:
            model.update_obs(frame.payload["observation"])
            return MessageType.INFER_RESULT, {"actions": model.get_action(), "latency_ms": 1.5}
        case kind:
            return MessageType(f"{kind.value}_ack"), {"ok": True}


def serve(model, heard):
    """A server of `model` on a free port."""

    def handle(socket):
        for message in socket:
            frame = decode_frame(message)
            heard.append(frame.message_type.value)
            if frame.message_type is MessageType.CLOSE:
                return
            try:
                kind, payload = answer(model, frame)
            except Exception as error:
                details = {"code": "infer_failed", "message": f"{type(error).__name__}: {error}", "details": {}}
                kind, payload = MessageType.ERROR, details
            socket.send(encode_frame(Frame(kind, frame.request_id, frame.evaluation_id, payload=payload)))

    server = websockets.sync.server.serve(handle, "127.0.0.1", 0, max_size=None)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"ws://127.0.0.1:{server.socket.getsockname()[1]}"


def until_closed(heard):
    """Waits for the last message of a client, which may arrive after the client has gone."""
    while heard[-1] != "close":
        time.sleep(0.01)


def evaluate(tandem, urls, out):
    """Returns the result of the one requested episode."""
    command = [tandem, "evaluate", "--tasks", TASK, "--seeds", str(SEED), "--protocol", "benchmark"]
    subprocess.run([*command, "--policy", f"xpolicylab:{urls}", "--out", out], check=True)
    [episode] = json.loads((out / "results.json").read_text())["episodes"]
    return episode


def main():
    tandem = tandem_of_command_line()
    with tempfile.TemporaryDirectory() as folder:
        model, heard = Model(rows(Path(folder) / "expert", [tandem])), []
        url = serve(model, heard)
        theirs = PolicyClient(url, "theirs")
        theirs.connect()
        theirs.reset("trial")
        state = {"left_ee_pose": np.zeros(7, np.float32)}
        look = {"data_format_version": "v1.0", "instruction": "wait", "state": state}
        look["vision"] = {"cam_head": {"color": np.zeros((240, 320, 3), np.uint8)}}
        assert len(theirs.infer(look, trial_id="trial", step=0).payload["actions"]) == CHUNK
        theirs.close()
        until_closed(heard)
        heard.clear()

        episode = evaluate(tandem, url, Path(folder) / "shared")
        until_closed(heard)
        # A server for each robot, one of which thinks for long; the other one hears that somebody is there still.
        alone = []
        urls = [serve(Model(model.told), alone), serve(Model(model.told, THINKS_S), [])]
        apart = evaluate(tandem, ",".join(urls), Path(folder) / "apart")
    print("heard", *dict.fromkeys(heard), "resets", model.resets)
    assert heard[:6] == ["hello", "prepare_case", "reset", "infer", "trial_end", "reset"], heard[:6]
    assert set(heard[6:-2]) == {"infer"} and heard[-2:] == ["trial_end", "close"], heard
    print(json.dumps(episode["phases"]), episode["ended"], episode["env_steps"])
    assert "p1" in episode["phases"], episode
    print(json.dumps(apart["phases"]), "heartbeats", alone.count("heartbeat"))
    assert "p1" in apart["phases"] and "heartbeat" in alone, (apart, alone)


if __name__ == "__main__":
    main()
