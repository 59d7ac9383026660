"""Plays an episode by a policy behind GR00T's wire format, msgpack over ZMQ, through `gateway/examples/bridges/gr00t_zmq.py`. The server
here reads and writes as GR00T's `PolicyServer` does; no model is behind it.

    pip install -r tests/peers/policies/gr00t.txt
    cargo build --release
    python tests/peers/policies/gr00t.py target/release/tandem
"""

import io
import pathlib
import subprocess
import sys
import threading

import msgpack
import numpy as np
import zmq

from arm_raise import RAISED_RAD, evaluate, tandem_of_command_line

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


def main():
    tandem = tandem_of_command_line()
    server = Server()
    command = [sys.executable, BRIDGE, "--server", f"tcp://127.0.0.1:{server.port}", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as bridge:
        try:
            url = bridge.stdout.readline().split()[0]
            results, done = evaluate(tandem, "--protocol", "benchmark", "--policy", f"act:{url}", "--policy-map", "gr00t_n17_g1")
        finally:
            bridge.terminate()
    [episode] = results["episodes"]
    # A trial, then fourteen requests for each robot and one more, and then the server fails.
    assert episode["env_steps"] == 14 * ROWS, (episode, done.stdout)
    assert "GR00T: CUDA out of memory" in episode["note"], episode
    last = [observation["state.left_arm"][0, 0, 0] for observation in server.seen[-2:]]
    assert all(abs(angle - RAISED_RAD) < 0.1 for angle in last), last
    print(f"gr00t      {len(server.seen)} requests, arms raised; then: {episode['note']}")


main()
