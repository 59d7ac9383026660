"""Lets LeRobot's policy server (async inference) answer Tandem: what comes as `/act` over HTTP goes on over gRPC.

    python -m lerobot.async_inference.policy_server --host=127.0.0.1 --port=8080
    python3 gateway/examples/bridges/lerobot_grpc.py --server 127.0.0.1:8080 --type act --policy USER/POLICY --chunk 50 --port 8001
    tandem evaluate --policy act:http://127.0.0.1:8001/act --policy-map lerobot.toml --protocol benchmark

Its messages are pickled objects of LeRobot's own, so it runs where `lerobot[async]` is installed, in the server's version. A server has
one client, so it takes one bridge, which robots and worlds share; a policy that remembers what it saw, as LeRobot's diffusion policy
does, needs a server and a bridge for each robot, and --jobs 1. The map, whose states and actions are those that the policy was trained
on:

    preset = "openpi"
    [images]
    "front" = { camera = "egocentric", size = [640, 480], fit = "stretch" }
    [state]
    "state" = ["left_arm", "right_arm"]
    [prompt]
    "task" = "text"
    [action]
    "action" = ["left_arm", "right_arm"]
    [chunk]
    rate_hz = 30.0
"""

import argparse
import base64
import http.server
import itertools
import json
import pickle
import threading
import time

import grpc
import numpy as np
from lerobot.async_inference.helpers import RemotePolicyConfig, TimedObservation
from lerobot.transport import services_pb2, services_pb2_grpc
from lerobot.transport.utils import grpc_channel_options, send_bytes_in_chunks


def from_json(entry):
    """Arrays as Tandem writes them; LeRobot writes into them."""
    if "__numpy__" in entry:
        values = np.frombuffer(base64.b64decode(entry["__numpy__"]), entry["dtype"])
        return values.reshape(entry["shape"]).copy()
    return entry


class LeRobot:
    """A policy server that is set up by the first request: only then are pictures' sizes known."""

    def __init__(self, args):
        self.args, self.lock, self.steps, self.is_set_up = args, threading.Lock(), itertools.count(), False
        channel = grpc.insecure_channel(args.server, grpc_channel_options())
        self.stub = services_pb2_grpc.AsyncInferenceStub(channel)

    def set_up(self, state, images):
        names = [f"joint_{index}" for index in range(len(state))]
        features = {"observation.state": {"dtype": "float32", "shape": (len(state),), "names": names}}
        for name, image in images.items():
            features[f"observation.images.{name}"] = {
                "dtype": "image",
                "shape": image.shape,
                "names": ["height", "width", "channels"],
            }
        config = RemotePolicyConfig(self.args.type, self.args.policy, features, self.args.chunk, self.args.device)
        self.stub.Ready(services_pb2.Empty())
        self.stub.SendPolicyInstructions(services_pb2.PolicySetup(data=pickle.dumps(config)))
        self.is_set_up = True

    def get_action(self, observation):
        state = observation["state"]
        images = {name: value for name, value in observation.items() if isinstance(value, np.ndarray) and value.ndim == 3}
        with self.lock:
            if not self.is_set_up:
                self.set_up(state, images)
            raw = {f"joint_{index}": float(value) for index, value in enumerate(state)}
            raw |= images | {"task": observation.get("task", "")}
            # Steps only go up, so that the server never takes a request for one that it has answered.
            step = next(self.steps) * self.args.chunk
            timed = TimedObservation(timestamp=time.time(), timestep=step, observation=raw, must_go=True)
            self.stub.SendObservations(send_bytes_in_chunks(pickle.dumps(timed), services_pb2.Observation, silent=True))
            answer = self.stub.GetActions(services_pb2.Empty())
        if not answer.data:
            raise RuntimeError("LeRobot's server gave no action; its log says why")
        return {"action": [action.get_action().tolist() for action in pickle.loads(answer.data)]}


def handler(policy):
    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self):
            body = self.rfile.read(int(self.headers["content-length"]))
            try:
                status, answer = 200, json.dumps(policy.get_action(json.loads(body, object_hook=from_json)))
            except Exception as error:
                status, answer = 500, str(error)
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
    parser.add_argument("--server", default="127.0.0.1:8080")
    parser.add_argument("--type", required=True, help="as LeRobot calls it: act, diffusion, pi05, smolvla, ...")
    parser.add_argument("--policy", required=True, help="a folder, or a name on the Hub")
    parser.add_argument("--chunk", type=int, default=50, help="rows of an answer")
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--port", type=int, default=8001)
    args = parser.parse_args()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", args.port), handler(LeRobot(args)))
    print(f"http://127.0.0.1:{server.server_port}/act asks {args.server}", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
