"""Times the first call of long episodes after a server was killed.

    python3 tests/peers/replicas/waking.py target/release/tandem
"""

import argparse
import subprocess
import tempfile
import time
import urllib.request

from behind_haproxy import Caller

PORT = 8711
STEPS = 5650
STEPS_PER_CALL = 25
TASKS = ["handover", "cart_service", "trash_collection", "move_house"]


def serve(program: str, runs: str) -> subprocess.Popen:
    command = [program, "serve", "--listen", f"127.0.0.1:{PORT}", "--runs", runs]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while True:
        try:
            urllib.request.urlopen(f"http://127.0.0.1:{PORT}/healthz", timeout=5).close()
            return process
        except OSError:
            time.sleep(0.02)


def call(tool: str, episode: str, arguments: dict) -> float:
    status, answer, took_s = Caller(PORT).post(f"/v1/episodes/{episode}/tools/{tool}", arguments)
    assert status == 200, answer
    return took_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    given = parser.parse_args()
    for task in TASKS:
        with tempfile.TemporaryDirectory() as runs:
            process = serve(given.program, runs)
            _, started, _ = Caller(PORT).post("/v1/episodes", {"task": task, "seed": 4242, "protocol": "agentic"})
            episode, played_s = started["episode_id"], 0.0
            for _ in range(STEPS // STEPS_PER_CALL):
                played_s += call("wait", episode, {"steps": STEPS_PER_CALL})
                call("observe", episode, {})
            process.kill()
            process.wait()
            began = time.monotonic()
            process = serve(given.program, runs)
            call("get_robot_state", episode, {"robot": "A"})
            print(f"{task}: answered {time.monotonic() - began:.1f} s after the start; its commands had taken {played_s:.1f} s")
            process.kill()
            process.wait()


if __name__ == "__main__":
    main()
