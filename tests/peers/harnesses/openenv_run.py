"""OpenEnv's client plays Handover on its server: `reset`, `step` and `state`, and two sessions side by side.

    pip install -r tests/peers/harnesses/openenv.txt
    pip install "./gateway/python[openenv]"
    python tests/peers/harnesses/openenv_run.py

The policy tells the robots by `send_joint_chunk` what an expert told them in this episode, and reaches every phase.
"""

import base64
import subprocess
import sys
import tempfile
import time
import urllib.request

from openenv.core.generic_client import GenericEnvClient

from demonstration import SEED, TASK, rows
from openenv_tandem import TandemAction, TandemClient

PORT = 18766
URL = f"http://127.0.0.1:{PORT}"
CHUNK = 25


def wait_for(url):
    for _ in range(300):
        try:
            return urllib.request.urlopen(url).read()
        except OSError:
            time.sleep(0.1)
    raise TimeoutError(url)


def play(told):
    with TandemClient(base_url=URL).sync() as client, GenericEnvClient(base_url=URL).sync() as other:
        began = client.reset(task=TASK, seed=SEED, protocol="benchmark")
        assert began.observation.reply["instruction"] and not began.done
        there = other.reset(task="co_carry", seed=2004)
        assert there.observation["reply"]["instruction"] != began.observation.reply["instruction"]
        looked = client.step(TandemAction(tool="observe"))
        picture = base64.b64decode(looked.observation.reply["images"][0]["png_base64"])
        assert picture.startswith(b"\x89PNG") and looked.reward == 0.0
        refused = client.step(TandemAction(tool="wait", arguments={"steps": "many"}))
        assert "expected a whole number" in refused.observation.problem, refused
        rewards, before = [], client.state()
        while told.size and not (rewards and done):
            chunk, told = told[:CHUNK], told[CHUNK:]
            robots = [{"robot": name, "rows": chunk[:, index].tolist()} for index, name in enumerate("AB")]
            stepped = client.step(TandemAction(tool="send_joint_chunk", arguments={"robots": robots}))
            assert stepped.observation.problem is None, stepped.observation.problem
            rewards.append(stepped.reward)
            done = stepped.done
        if not done:
            stepped = client.step(TandemAction(tool="finish"))
            rewards.append(stepped.reward)
        state = client.state()
        assert stepped.done and sum(rewards) == 3.0 == state.phases, (rewards, state)
        assert state.step_count > before.step_count and (state.task, state.seed) == (TASK, SEED)
        assert other.step({"tool": "wait", "arguments": {"steps": 5}}).observation["reply"]["executed_steps"] == 5
    print("OpenEnv:", stepped.observation.result["phases"], "after", state.step_count, "steps; rewards", sum(rewards))


def main():
    server = subprocess.Popen([sys.executable, "-m", "openenv_tandem", "--port", str(PORT)])
    try:
        print(wait_for(f"{URL}/health"), wait_for(f"{URL}/metadata"))
        with tempfile.TemporaryDirectory() as folder:
            play(rows(folder))
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main()
