"""Bridge from Tandem to GR00T's own server: passes `/act` requests over HTTP to its `get_action` over ZMQ.

    python3 gateway/examples/bridges/gr00t_zmq.py --server tcp://127.0.0.1:5555 --port 8001
    tandem evaluate --policy act:http://127.0.0.1:8001/act --policy-map gr00t_n17_g1 --protocol benchmark

It needs numpy, msgpack and pyzmq. The server is that of Isaac-GR00T (N1.6 and N1.7), with the flat keys of `Gr00tSimPolicyWrapper`
(`--use-sim-policy-wrapper`), as the preset gr00t_n17_g1 has them.
"""

import argparse
import base64
import http.server
import io
import json
import threading

import msgpack
import numpy as np
import zmq


def to_npy(value):
    """Encodes arrays like GR00T's `MsgSerializer`."""
    if isinstance(value, np.ndarray):
        file = io.BytesIO()
        np.save(file, value, allow_pickle=False)
        return {"__ndarray_class__": True, "as_npy": file.getvalue()}
    raise TypeError(f"no {type(value).__name__} is sent to GR00T")


def from_npy(entry):
    if "__ndarray_class__" in entry:
        return np.load(io.BytesIO(entry["as_npy"]), allow_pickle=False)
    return entry


def from_json(entry):
    """Encodes arrays like Tandem."""
    if "__numpy__" in entry:
        values = np.frombuffer(base64.b64decode(entry["__numpy__"]), entry["dtype"])
        return values.reshape(entry["shape"])
    return entry


def to_json(value):
    if isinstance(value, np.ndarray):
        return value.astype(float).tolist()
    raise TypeError(f"no {type(value).__name__} is sent to Tandem")


class Gr00t:
    """A server that answers one request after the other."""

    def __init__(self, address, token, timeout_s):
        self.address, self.token, self.timeout_s = address, token, timeout_s
        self.lock, self.socket = threading.Lock(), None

    def connect(self):
        self.socket = zmq.Context.instance().socket(zmq.REQ)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.setsockopt(zmq.RCVTIMEO, int(1000 * self.timeout_s))
        self.socket.connect(self.address)

    def get_action(self, observation):
        request = {"endpoint": "get_action", "data": {"observation": observation, "options": None}}
        if self.token:
            request["api_token"] = self.token
        with self.lock:
            if self.socket is None:
                self.connect()
            try:
                self.socket.send(msgpack.packb(request, default=to_npy))
                answer = msgpack.unpackb(self.socket.recv(), object_hook=from_npy)
            except zmq.ZMQError as error:
                # A socket that waits for an answer accepts no other request.
                self.socket.close()
                self.socket = None
                raise RuntimeError(f"GR00T at {self.address}: {error}") from error
        if isinstance(answer, dict) and "error" in answer:
            raise RuntimeError(f"GR00T: {answer['error']}")
        # Newer servers return the action with further information.
        return answer[0] if isinstance(answer, list) else answer


def handler(policy):
    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        disable_nagle_algorithm = True

        def do_POST(self):
            body = self.rfile.read(int(self.headers["content-length"]))
            try:
                action = policy.get_action(json.loads(body, object_hook=from_json))
                status, answer = 200, json.dumps(action, default=to_json)
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
    parser.add_argument("--server", default="tcp://127.0.0.1:5555")
    parser.add_argument("--port", type=int, default=8001)
    parser.add_argument("--token")
    parser.add_argument("--timeout-s", type=float, default=600)
    args = parser.parse_args()
    policy = Gr00t(args.server, args.token, args.timeout_s)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", args.port), handler(policy))
    print(f"http://127.0.0.1:{server.server_port}/act asks {args.server}", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
