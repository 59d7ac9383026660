"""Two thousand episodes at one server, of which fifty are played: their memory, and their effect on the fifty. The
fifty are alone before and after: whatever grows slower with their age is no matter of the others.

    python3 tests/peers/replicas/idle_episodes.py target/release/tandem
"""

import argparse
import http.client
import pathlib
import statistics
import subprocess
import tempfile
import threading
import time

from behind_haproxy import Caller

PORT = 8710


def memory_mb(process: subprocess.Popen) -> dict[str, int]:
    lines = pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines()
    read = {name: int(value.split()[0]) // 1024 for name, value in (line.split(":", 1) for line in lines if line.startswith("Vm"))}
    return {"now_mb": read["VmRSS"], "most_mb": read["VmHWM"]}


def start(count: int, first_seed: int) -> list[str]:
    caller, ids = Caller(PORT), []
    for seed in range(first_seed, first_seed + count):
        status, started, _ = caller.post("/v1/episodes", {"task": "handover", "seed": seed, "protocol": "benchmark"})
        assert status == 201, started
        ids.append(started["episode_id"])
        caller.post(f"/v1/episodes/{ids[-1]}/tools/wait", {"steps": 5})
    return ids


def end(ids: list[str]) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", PORT)
    for episode in ids:
        connection.request("DELETE", f"/v1/episodes/{episode}")
        with connection.getresponse() as response:
            response.read()
            assert response.status == 200, response.status


def play(ids: list[str], calls: int, think_s: float) -> dict[str, float]:
    """Returns the times of calls without physics: medians of three rounds, after one that wakes the episodes."""
    rounds = [play_round(ids, calls, think_s) for _ in range(4)][1:]
    return {name: statistics.median(took[name] for took in rounds) for name in rounds[0]}


def play_round(ids: list[str], calls: int, think_s: float) -> dict[str, float]:
    """Plays each episode by a separate agent."""
    looks_ms: list[float] = []

    def agent(episode: str) -> None:
        caller = Caller(PORT)
        for _ in range(calls):
            caller.post(f"/v1/episodes/{episode}/tools/wait", {"steps": 2})
            time.sleep(think_s)
            status, answer, took_s = caller.post(f"/v1/episodes/{episode}/tools/get_robot_state", {"robot": "A"})
            assert status == 200, answer
            looks_ms.append(1000 * took_s)

    threads = [threading.Thread(target=agent, args=(episode,)) for episode in ids]
    for thread in threads:
        thread.start()
        time.sleep(think_s / len(ids))
    for thread in threads:
        thread.join()
    looks_ms.sort()
    return {"p50_ms": round(statistics.median(looks_ms), 2), "p99_ms": round(looks_ms[int(0.99 * len(looks_ms))], 2)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("--held", type=int, default=2000)
    parser.add_argument("--active", type=int, default=50)
    parser.add_argument("--calls", type=int, default=20)
    parser.add_argument("--think-s", type=float, default=1.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as runs:
        command = [given.program, "serve", "--listen", f"127.0.0.1:{PORT}", "--runs", runs, "--idle-timeout", "86400"]
        command += ["--max-episodes", str(given.held)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            time.sleep(1)
            active = start(given.active, 4000)
            before = play(active, given.calls, given.think_s)
            print(f"{given.active} alone:", before, memory_mb(process))
            began = time.monotonic()
            rest = start(given.held - given.active, 10_000)
            print(f"{len(rest)} more in {time.monotonic() - began:.0f} s:", memory_mb(process))
            beside = play(active, given.calls, given.think_s)
            print(f"{given.active} of {given.held}:", beside, memory_mb(process))
            woken = []
            for episode in rest[:50]:
                status, _, took_s = Caller(PORT).post(f"/v1/episodes/{episode}/tools/get_robot_state", {"robot": "A"})
                assert status == 200
                woken.append(1000 * took_s)
            print(f"a call that wakes one of them: {statistics.median(woken):.0f} ms", memory_mb(process))
            end(rest)
            after = play(active, given.calls, given.think_s)
            print(f"{given.active} alone again:", after, memory_mb(process))
            for name, beside_ms in beside.items():
                print(f"{name}: {beside_ms / (0.5 * (before[name] + after[name])):.2f} times as long beside the others")
        finally:
            process.kill()
            process.wait()


if __name__ == "__main__":
    main()
