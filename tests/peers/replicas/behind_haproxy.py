"""Two hundred scripted agents at three servers behind HAProxy, one of which is killed and one added during the run.

    apt-get install haproxy
    python3 tests/peers/replicas/behind_haproxy.py target/release/tandem

Nothing that an agent was answered is lost, nothing is done twice, and the same agents at one server say what HAProxy and the others cost.
"""

import argparse
import contextlib
import http.client
import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
import uuid

CONFIGURATION = pathlib.Path(__file__).parents[3] / "gateway/examples/replicas/haproxy.cfg"
FIRST_PORT = 8701
ENTRY_PORT = 8700
GIVE_UP_S = 60.0


class Caller:
    """One agent's connections. It follows redirects, and repeats requests without an answer."""

    def __init__(self, port: int) -> None:
        self.entry = ("127.0.0.1", port)
        self.connections: dict[tuple[str, int], http.client.HTTPConnection] = {}
        self.repeated = self.redirected = 0

    def post(self, path: str, body: object) -> tuple[int, dict, float]:
        """Returns the answer to a call, and the duration of the answered attempt."""
        key, deadline, address = uuid.uuid4().hex, time.monotonic() + GIVE_UP_S, self.entry
        while True:
            began = time.perf_counter()
            try:
                status, answer, location = self._send(address, path, body, key)
                if status == 307:
                    self.redirected += 1
                    parts = urllib.parse.urlsplit(location)
                    status, answer, _ = self._send((parts.hostname, parts.port), path, body, key)
                if status not in (307, 502, 503, 504):
                    return status, answer, time.perf_counter() - began
            except (OSError, http.client.HTTPException):
                pass
            if time.monotonic() > deadline:
                raise TimeoutError(path)
            self.repeated += 1
            time.sleep(0.1)

    def _send(self, address, path, body, key):
        connection = self.connections.setdefault(address, http.client.HTTPConnection(*address, timeout=30))
        headers = {"content-type": "application/json", "idempotency-key": key}
        try:
            connection.request("POST", path, json.dumps(body), headers)
            response = connection.getresponse()
            content = response.read()
        except (OSError, http.client.HTTPException):
            connection.close()
            raise
        return response.status, json.loads(content) if content.startswith(b"{") else {}, response.getheader("location")


def agent(port: int, seed: int, calls: int, think_s: float, told: dict) -> None:
    caller = Caller(port)
    status, started, _ = caller.post("/v1/episodes", {"task": "handover", "seed": seed, "protocol": "benchmark"})
    assert status == 201, started
    tools = f"/v1/episodes/{started['episode_id']}/tools/"
    step, looks_s = 0, []
    for number in range(calls):
        status, answer, _ = caller.post(tools + "wait", {"steps": 2})
        step += 2
        assert (status, answer.get("step")) == (200, step), (status, answer)
        time.sleep(think_s)
        status, answer, took_s = caller.post(tools + "get_robot_state", {"robot": "A"})
        assert (status, answer.get("step")) == (200, step), (status, answer)
        if number > 0:
            looks_s.append(took_s)
    status, result, _ = caller.post(tools + "finish", {})
    assert status == 200 and result["env_steps"] == step and result["tool_calls"] == 2 * calls + 1, result
    told[seed] = (looks_s, caller.repeated, caller.redirected)


def play(port: int, agents: int, calls: int, think_s: float, meanwhile=lambda: None) -> dict:
    told: dict = {}
    threads = [threading.Thread(target=agent, args=(port, seed, calls, think_s, told)) for seed in range(4000, 4000 + agents)]
    for thread in threads:
        thread.start()
        time.sleep(0.1)
    meanwhile()
    for thread in threads:
        thread.join()
    assert len(told) == agents, f"{agents - len(told)} agents failed"
    looks_ms = sorted(1000 * look for looks_s, _, _ in told.values() for look in looks_s)
    return {
        "looks": len(looks_ms),
        "p50_ms": round(statistics.median(looks_ms), 2),
        "p99_ms": round(looks_ms[int(0.99 * len(looks_ms))], 2),
        "repeated": sum(repeated for _, repeated, _ in told.values()),
        "redirected": sum(redirected for _, _, redirected in told.values()),
    }


@contextlib.contextmanager
def server(program: str, runs: str, port: int):
    url = f"http://127.0.0.1:{port}"
    command = [program, "serve", "--listen", f"127.0.0.1:{port}", "--advertise", url, "--runs", runs]
    process = subprocess.Popen(command + ["--max-episodes", "400"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("--agents", type=int, default=200)
    parser.add_argument("--calls", type=int, default=20)
    parser.add_argument("--think-s", type=float, default=1.0)
    given = parser.parse_args()
    if shutil.which("haproxy") is None:
        sys.exit("haproxy is not installed; apt-get install haproxy")
    asked = (given.agents, given.calls, given.think_s)
    with tempfile.TemporaryDirectory() as runs, server(given.program, runs, FIRST_PORT):
        time.sleep(1)
        print("one server:", play(FIRST_PORT, *asked))
    with tempfile.TemporaryDirectory() as runs, contextlib.ExitStack() as stack:
        servers = [stack.enter_context(server(given.program, runs, FIRST_PORT + number)) for number in range(3)]
        proxy = stack.enter_context(subprocess.Popen(["haproxy", "-f", str(CONFIGURATION)], stderr=subprocess.DEVNULL))
        stack.callback(proxy.kill)
        time.sleep(2)
        print("three behind HAProxy:", play(ENTRY_PORT, *asked))

        def kill_and_add() -> None:
            time.sleep(given.think_s * 2)
            servers[1].kill()
            time.sleep(given.think_s * 2)
            stack.enter_context(server(given.program, runs, FIRST_PORT + 3))

        print("one killed and one added:", play(ENTRY_PORT, *asked, kill_and_add))


if __name__ == "__main__":
    main()
