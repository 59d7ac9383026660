"""Plays an episode by a policy behind GR00T's wire format, msgpack over ZMQ, through `gateway/examples/bridges/gr00t_zmq.py`. The server
here reads and writes as GR00T's `PolicyServer` does; no model is behind it. GR00T itself is on no package registry.

    pip install -r tests/peers/policies/gr00t.txt
    pip install ./gateway/python
    cargo build --release
    python tests/peers/policies/gr00t.py target/release/tandem
"""

import io
import json
import pathlib
import subprocess
import sys
import tempfile
import threading

import msgpack
import numpy as np
import zmq

from arm_raise import RAISED_RAD, evaluate, tandem_of_command_line

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "harnesses"))
from demonstration import SEED, TASK, rows

BRIDGE = pathlib.Path(__file__).resolve().parents[3] / "gateway/examples/bridges/gr00t_zmq.py"
ROWS = 16
PARTS = {"left_arm": 7, "right_arm": 7, "left_hand": 7, "right_hand": 7, "waist": 3}


def encode(value):
    if isinstance(value, np.ndarray):
        file = io.BytesIO()
        np.save(file, value, allow_pickle=False)
        return {"__ndarray_class__": True, "as_npy": file.getvalue()}
    return value


def decode(entry):
    if "__ndarray_class__" in entry:
        return np.load(io.BytesIO(entry["as_npy"]), allow_pickle=False)
    return entry


class Server:
    def __init__(self):
        self.seen, self.first = [], {}
        socket = zmq.Context.instance().socket(zmq.REP)
        self.port = socket.bind_to_random_port("tcp://127.0.0.1")
        threading.Thread(target=self.serve, args=[socket], daemon=True).start()

    def serve(self, socket):
        while True:
            request = msgpack.unpackb(socket.recv(), object_hook=decode)
            try:
                answer = self.get_action(**request["data"])
            except Exception as error:
                answer = {"error": str(error)}
            socket.send(msgpack.packb(answer, default=encode))

    def get_action(self, observation, options):
        if len(self.seen) == 30:
            raise RuntimeError("CUDA out of memory")
        assert observation["video.ego_view"].shape == (1, 1, 240, 320, 3) and observation["video.ego_view"].dtype == np.uint8
        assert observation["state.left_arm"].shape == (1, 1, 7) and observation["state.left_arm"].dtype == np.float32
        [words] = observation["annotation.human.task_description"]
        self.seen.append(observation)
        first = observation if len(self.seen) == 1 else self.first.setdefault(words, observation)
        action = {f"action.{part}": np.repeat(first[f"state.{part}"], ROWS, axis=1) for part in PARTS}
        action["action.left_arm"][..., 0] = np.linspace(observation["state.left_arm"][0, 0, 0], RAISED_RAD, ROWS)
        action["action.base_height_command"] = np.full((1, ROWS, 1), 0.74, np.float32)
        action["action.navigate_command"] = np.zeros((1, ROWS, 3), np.float32)
        return action, {"model": "none"}


class Demonstration(Server):
    """Repeats the commands of an expert."""

    def __init__(self, told):
        self.told, self.looks = told, {}
        super().__init__()

    def get_action(self, observation, options):
        if not observation["video.ego_view"].any():
            at = np.zeros(ROWS, int)  # a trial without a robot
        else:
            [words] = observation["annotation.human.task_description"]
            look = self.looks[words] = self.looks.get(words, -1) + 1
            at = np.minimum(np.arange(look * ROWS, (look + 1) * ROWS), len(self.told) - 1)
        robot = 0 if "Take the bottle" in observation["annotation.human.task_description"][0] else 1
        told = self.told[at, robot].astype(np.float32)[None]
        begin, action = 0, {}
        for part, width in {**PARTS, "base": 4}.items():
            action[f"action.{part}"] = told[..., begin : begin + width]
            begin += width
        base = action.pop("action.base")
        return {**action, "action.base_height_command": base[..., 3:], "action.navigate_command": base[..., :3]}, {}


def asked(tandem, server, run):
    """Returns the result of `run` for an address at which `server` answers behind the bridge."""
    command = [sys.executable, BRIDGE, "--server", f"tcp://127.0.0.1:{server.port}", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as bridge:
        try:
            url = bridge.stdout.readline().split()[0]
            return run(tandem, "--protocol", "benchmark", "--policy", f"act:{url}", "--policy-map", "gr00t_n17_g1")
        finally:
            bridge.terminate()


def evaluate_demonstrated(tandem, *flags):
    with tempfile.TemporaryDirectory() as folder:
        command = [tandem, "evaluate", "--tasks", TASK, "--seeds", str(SEED), "--out", folder, *flags]
        subprocess.run(command, check=True, capture_output=True)
        return json.loads((pathlib.Path(folder) / "results.json").read_text())


def main():
    tandem = tandem_of_command_line()
    with tempfile.TemporaryDirectory() as folder:
        told = rows(pathlib.Path(folder), [tandem])
    [episode] = asked(tandem, Demonstration(told), evaluate_demonstrated)["episodes"]
    assert "p1" in episode["phases"], episode
    print(f"gr00t      {episode['phases']} of an expert's rows")
    server = Server()
    results, done = asked(tandem, server, evaluate)
    [episode] = results["episodes"]
    # A trial, then fourteen requests for each robot and one more, and then the server fails.
    assert episode["env_steps"] == 14 * ROWS, (episode, done.stdout)
    assert "GR00T: CUDA out of memory" in episode["note"], episode
    last = [observation["state.left_arm"][0, 0, 0] for observation in server.seen[-2:]]
    assert all(abs(angle - RAISED_RAD) < 0.1 for angle in last), last
    print(f"gr00t      {len(server.seen)} requests, arms raised; then: {episode['note']}")


main()
