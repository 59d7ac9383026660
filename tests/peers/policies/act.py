"""Plays an episode by a policy behind `/act`, with arrays in the format of the package json_numpy.

    pip install -r tests/peers/policies/act.txt
    cargo build --release
    python tests/peers/policies/act.py target/release/tandem
"""

import http.server
import threading

import json_numpy

from arm_raise import ArmRaise, evaluate, tandem_of_command_line


def serve(policy):
    """A server of `policy` on a free port."""

    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        disable_nagle_algorithm = True

        def do_POST(self):
            body = self.rfile.read(int(self.headers["content-length"]))
            answer = json_numpy.dumps(policy.infer(json_numpy.loads(body))).encode()
            self.send_response(200)
            self.send_header("content-type", "application/json")
            self.send_header("content-length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/act"


def main():
    tandem = tandem_of_command_line()
    policy = ArmRaise()
    flags = ["--policy", f"act:{serve(policy)}", "--policy-map", "openpi", "--policy-name", "arm raise"]
    results, done = evaluate(tandem, "--protocol", "benchmark", *flags)
    [episode] = results["episodes"]
    assert (episode["ended"], episode["env_steps"]) == ("step_budget_exhausted", 1000), episode
    assert results["policy"] == "arm raise" and done.returncode == 0
    policy.check()
    print(f"act        {len(policy.seen)} requests, arm raised")


if __name__ == "__main__":
    main()
