"""Plays an episode by a policy behind openpi's own wire format: `msgpack_numpy` of the package openpi-client, and the protocol of
openpi's `websocket_policy_server`. Its client is tried on the same server first.

    pip install -r tests/peers/policies/openpi.txt
    cargo build --release
    python tests/peers/policies/openpi.py target/release/tandem
"""

import threading
import time
import traceback

import numpy as np
import websockets.sync.server
from openpi_client import msgpack_numpy, websocket_client_policy

from arm_raise import JOINTS, ArmRaise, evaluate, tandem_of_command_line

INTERNAL_ERROR = 1011


def serve(policy, **settings):
    """A server of `policy` on a free port: metadata first, then an answer to each message, or a traceback as text."""

    def handle(socket):
        packer = msgpack_numpy.Packer()
        socket.send(packer.pack({"model": type(policy).__name__}))
        while True:
            try:
                answer = policy.infer(msgpack_numpy.unpackb(socket.recv()))
                answer["server_timing"] = {"infer_ms": 1.5}
                socket.send(packer.pack(answer))
            except websockets.ConnectionClosed:
                return
            except Exception:
                socket.send(traceback.format_exc())
                socket.close(INTERNAL_ERROR, "Internal server error. Traceback included in previous frame.")
                return

    server = websockets.sync.server.serve(handle, "127.0.0.1", 0, compression=None, max_size=None, **settings)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server.socket.getsockname()[1]


class Forgetful(ArmRaise):
    """Fails at its fourth request."""

    def infer(self, observation):
        if len(self.seen) == 3:
            raise RuntimeError("lost its weights")
        return super().infer(observation)


class Slow(ArmRaise):
    """Takes a long time for its third request."""

    def infer(self, observation):
        if len(self.seen) == 2:
            time.sleep(20)
        return super().infer(observation)


def main():
    tandem = tandem_of_command_line()
    policy = ArmRaise()
    port = serve(policy)
    client = websocket_client_policy.WebsocketClientPolicy(host="127.0.0.1", port=port)
    state = np.zeros(JOINTS, np.float32)
    theirs = client.infer({"observation/state": state, "observation/image": np.zeros((224, 224, 3), np.uint8), "prompt": "wait"})
    assert theirs["actions"].shape == (50, 35)
    policy.seen.clear()

    url = f"ws://127.0.0.1:{port}"
    results, done = evaluate(tandem, "--protocol", "benchmark", "--policy", f"openpi:{url}")
    [episode] = results["episodes"]
    assert (episode["ended"], episode["env_steps"]) == ("step_budget_exhausted", 1000), episode
    assert results["policy"] == f"openpi:{url}" and done.returncode == 0
    policy.check()
    print(f"openpi     {len(policy.seen)} requests, arm raised")

    results, _ = evaluate(tandem, "--protocol", "benchmark", "--policy", f"openpi:ws://127.0.0.1:{serve(Forgetful())}")
    [episode] = results["episodes"]
    assert episode["note"].endswith("failed: RuntimeError: lost its weights"), episode["note"]
    print(f"failing    {episode['note']}")

    # A server asks whether anybody is there while its client waits for the other robot's server, as websockets does each 20 s.
    asking = {"ping_interval": 6, "ping_timeout": 6}
    urls = ",".join(f"ws://127.0.0.1:{serve(policy, **asking)}" for policy in (ArmRaise(), Slow()))
    results, _ = evaluate(tandem, "--protocol", "benchmark", "--policy", f"openpi:{urls}")
    [episode] = results["episodes"]
    assert (episode["ended"], episode["env_steps"]) == ("step_budget_exhausted", 1000), episode
    print("waiting    both servers are there to the end")


if __name__ == "__main__":
    main()
