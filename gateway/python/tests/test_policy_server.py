"""A function as a policy server for the program."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import tandem

MAP = """preset = "openpi"
scope = "local"
answer = "one"
[images]
"image" = { camera = "egocentric", size = [32, 24], fit = "stretch" }
[state]
"state" = ["joints"]
"moment" = ["episode", "step", "reset"]
[prompt]
"prompt" = "text"
[action]
"arms" = ["left_arm", "right_arm"]
[chunk]
rows = 50
rate_hz = 10.0
"""


def evaluate(folder: Path, server: tandem.PolicyServer, seeds: str) -> dict[str, Any]:
    (folder / "map.toml").write_text(MAP)
    flags = ["--policy", server.url, "--policy-map", "map.toml", "--protocol", "benchmark", "--tasks", "handover"]
    # Policies read the seed, which is withheld under "paper".
    flags += ["--seeds", seeds, "--jobs", "2", "--out", "out", "--assistance", "full"]
    command = [sys.executable, "-m", "tandem", "evaluate", *flags]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "out/results.json").read_text())


def test_each_robot_of_each_episode_has_a_memory_of_its_own(tmp_path: Path) -> None:
    """Two episodes are played at once; each policy counts its requests in its memory."""
    seen: dict[str, list[tuple[int, int, int]]] = {"A": [], "B": []}

    def policy(robot: str) -> Any:
        def infer(observation: dict[str, Any], memory: dict[str, Any]) -> dict[str, NDArray[np.float64]]:
            image: NDArray[np.uint8] = observation["image"]
            assert image.shape == (24, 32, 3) and image.dtype == np.uint8
            memory["requests"] = memory.get("requests", 0) + 1
            episode, step, _ = (int(number) for number in observation["moment"])
            seen[robot].append((episode, step, memory["requests"]))
            return {"arms": np.zeros((50, 14))}

        return infer

    with tandem.serve_policy({robot: policy(robot) for robot in seen}) as server:
        assert server.url.endswith("/B")
        results = evaluate(tmp_path, server, "2000-2001")
    assert [episode["env_steps"] for episode in results["episodes"]] == [1000, 1000]
    for asked in seen.values():
        played = [entry for entry in asked if entry[0] != 0]
        episodes = sorted({episode for episode, _, _ in played})
        assert [episode % 1_000_000 for episode in episodes] == [2000, 2001]
        for episode in episodes:
            assert [(step, count) for other, step, count in played if other == episode] == [
                (250 * number, number + 1) for number in range(4)
            ]


def post(server: tandem.PolicyServer, path: str, body: bytes) -> tuple[int, str]:
    request = urllib.request.Request(server.url.removeprefix("act:").rsplit("/", 1)[0] + path, body)
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def test_what_goes_wrong_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    def infer(observation: dict[str, Any], memory: dict[str, Any]) -> dict[str, Any]:
        return {"doubled": 2 * observation["x"]}

    array = {"__numpy__": base64.b64encode(np.array([1.5, -2], "<f4").tobytes()).decode(), "dtype": "<f4", "shape": [1, 2]}
    with tandem.serve_policy(infer) as server:
        assert post(server, "/act", json.dumps({"x": array}).encode()) == (200, '{"doubled": [[3.0, -4.0]]}')
        for _ in range(2):
            assert post(server, "/act", b"{}") == (500, "KeyError: 'x'")
        printed = capsys.readouterr().err
        assert printed.count("Traceback") == 1 and "in infer" in printed
        assert post(server, "/A", b"{}") == (404, "no policy at /A; have: /act")
        status, said = post(server, "/act", b"?")
        assert status == 400 and "json_numpy" in said
    with pytest.raises(tandem.TandemError, match="one for each robot"):
        tandem.serve_policy({})
