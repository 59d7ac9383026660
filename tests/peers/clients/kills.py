"""Kills `tandem` at random moments while it records, evaluates and draws pictures, and checks the remaining files.

    cargo build --release
    python tests/peers/clients/kills.py [KILLS] [SEED]          # 20 kills while recording and 5 each of the others

Of a recording that was under way at most 25 of the control steps may be missing that the server had answered for, and
`recover` has to make it whole; what was stopped has to go on, and to end as it ends when nobody stops it. Needs nothing but
Python.
"""

import http.client
import json
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

TANDEM = Path(__file__).resolve().parents[3] / "target/release/tandem"
TASKS, SEEDS = "handover", "0-1"
MIN_S, MAX_S = 0.3, 2.5
# A server is killed so long after its episode has begun.
SERVED_S = 0.05, 0.7
MAX_MISSING = 25


def tandem(*words):
    return [str(TANDEM), *map(str, words)]


def killed(command, after_s):
    """Returns whether it was still running when it was killed."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=after_s)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
        return True
    return False


def run(command):
    return subprocess.run(command, capture_output=True, text=True, timeout=600)


def steps_in(text):
    """Returns the number of control steps that `replay --verify` found in a recording."""
    return int(text.split("verified: ")[1].split()[0])


def unanswered_in(text):
    """Steps of a call that the kill left without an answer."""
    return int(text.split("the last ")[1].split()[0]) if "the last " in text else 0


def post(url, body):
    request = urllib.request.Request(url, json.dumps(body).encode(), {"content-type": "application/json"})
    with urllib.request.urlopen(request, timeout=30) as response:
        return json.load(response)


def steps_before_kill(chance, seed, runs):
    """Returns the number of control steps that a server had answered when it was killed, under calls without a pause."""
    command = tandem("serve", "--listen", "127.0.0.1:0", "--runs", runs, "--renderer", "cpu")
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    line = next(line for line in server.stderr if "http://" in line)
    threading.Thread(target=server.stderr.read, daemon=True).start()
    episodes = "http://" + line.split("http://")[1].strip() + "/v1/episodes"
    started = post(episodes, {"task": TASKS, "seed": seed, "protocol": "benchmark"})
    threading.Timer(chance.uniform(*SERVED_S), server.kill).start()
    made = 0
    try:
        while True:
            steps = chance.randint(1, 25)
            made += post(f"{episodes}/{started['episode_id']}/tools/wait", {"steps": steps})["executed_steps"]
    except (OSError, ValueError, http.client.HTTPException):
        # The server has gone, in the middle of a reply perhaps.
        server.wait()
    return made


def recordings(chance, kills, work):
    """Kills a server that records. The remaining file can be recovered and verified, and few steps are missing."""
    faults, missing = [], []
    for number in range(kills):
        runs = work / f"recording{number}"
        made = steps_before_kill(chance, number, runs)
        left = list(runs.glob("*/episode.mcap.partial"))
        if not left:
            print(f"recording {number}: its steps were used up before the kill")
            continue
        (partial,) = left
        recovered = run(tandem("recover", partial))
        verified = run(tandem("replay", partial.with_name("episode.mcap"), "--verify"))
        if recovered.returncode or verified.returncode:
            faults.append(f"recording {number}: {recovered.stderr}{verified.stdout}{verified.stderr}")
            continue
        # The first state is that before the first step.
        kept = steps_in(verified.stdout) + unanswered_in(verified.stdout) - 1
        missing.append(max(0, made - kept))
        print(f"recording {number}: {made} steps answered, {kept} kept and verified")
    if missing:
        print(f"at most {max(missing)} steps missing over {len(missing)} kills")
    if not missing or max(missing) > MAX_MISSING:
        faults.append(f"steps missing: {missing}")
    return faults


def tree(folder):
    """Every picture's bytes."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*.png"))}


def scores(folder):
    """Returns the result of every episode."""
    episodes = {path.name: json.loads(path.read_text()) for path in sorted((folder / "episodes").glob("*.json"))}
    keys = ("state_hash", "phases", "steps", "ended")
    return {name: {key: str(find(episode, key)) for key in keys} for name, episode in episodes.items()}


def find(value, key):
    """Returns the first field of that name at any depth."""
    if isinstance(value, dict):
        if key in value:
            return value[key]
        value = list(value.values())
    if isinstance(value, list):
        return next((found for found in (find(item, key) for item in value) if found is not None), None)
    return None


def resumed(chance, kills, work, name, command, outcome):
    """Kills `command` repeatedly in one folder, lets it end, and compares the folder with an uninterrupted run."""
    stopped, whole = work / f"{name}-stopped", work / f"{name}-whole"
    hits = sum(killed(command(stopped), chance.uniform(MIN_S, MAX_S)) for _ in range(kills))
    ends = [run(command(folder)) for folder in (stopped, whole)]
    faults = [f"{name}: {end.stderr}" for end in ends if end.returncode]
    here, there = outcome(stopped), outcome(whole)
    if here != there or not here:
        differing = sorted(key for key in here.keys() | there.keys() if here.get(key) != there.get(key))
        faults.append(f"{name}: after {hits} kills {differing[:4]} differ ({len(here)} and {len(there)} files)")
    print(f"{name}: {hits} kills, {len(here)} files as without")
    return faults


def main(kills=20, seed=0):
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        faults = recordings(chance, kills, work)
        few = max(1, kills // 4)
        evaluate = lambda out: tandem("evaluate", "--tasks", TASKS, "--seeds", SEEDS, "--record", "--out", out)
        faults += resumed(chance, few, work, "evaluate", evaluate, scores)
        mcap = next((work / "evaluate-whole").rglob("episode.mcap"))
        pictures = lambda out: tandem("replay", mcap, "--render", out, "--rate", 5)
        faults += resumed(chance, few, work, "render", pictures, tree)
    print("\n".join(faults) or "nothing was lost")
    return not faults


if __name__ == "__main__":
    sys.exit(0 if main(*map(int, sys.argv[1:])) else 1)
