"""Drives a running server like learned policies: MessagePack, numpy, one call per chunk; then one operator per robot.

    pip install -r tests/peers/clients/client.txt
    tandem serve --max-episodes 16 &
    python tests/peers/clients/client.py http://127.0.0.1:8700

A token that the server wants is read from the environment, TANDEM_TOKEN.
"""

import io
import os
import sys
import threading
import uuid

import msgpack
import numpy as np
import requests
from PIL import Image

TOKEN = os.environ.get("TANDEM_TOKEN")
SHAPE = (240, 320)


def call(url, body, token=TOKEN, **headers):
    """Sends a request in MessagePack, and returns its reply."""
    headers = {"content-type": "application/msgpack", **headers}
    if token:
        headers["authorization"] = f"Bearer {token}"
    answer = requests.post(url, msgpack.packb(body), headers=headers, timeout=120)
    if not answer.ok:
        raise RuntimeError(f"{answer.status_code} {answer.json()['detail']}")
    return msgpack.unpackb(answer.content)


def start(server, **fields):
    body = {"task": "handover", "seed": 0, "protocol": "benchmark", **fields}
    started = call(f"{server}/v1/episodes", body)
    return started, f"{server}/v1/episodes/{started['episode_id']}/tools"


def standing_rows(robot, steps):
    """Present joint targets of a robot, with which it keeps its posture."""
    angles = robot["joint_positions_rad"]
    arm = lambda side: [
        angles[f"{side}_{joint}_joint"]
        for joint in ("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow", "wrist_roll", "wrist_pitch", "wrist_yaw")
    ]
    fingers = ("thumb_0", "thumb_1", "thumb_2", "middle_0", "middle_1", "index_0", "index_1")
    hand = lambda side: [angles[f"{side}_hand_{finger}_joint"] for finger in fingers]
    waist = [angles[f"waist_{axis}_joint"] for axis in ("yaw", "roll", "pitch")]
    row = np.array([*arm("left"), *arm("right"), *hand("left"), *hand("right"), *waist, 0, 0, 0, 0.75])
    return np.tile(row, (steps, 1))


def check_pictures(tools):
    """Checks that all forms of an image contain the same pixels, and that depth equals the measured depth."""
    raw = call(f"{tools}/observe", {"images": "rgb", "depth": "float16"})
    files = call(f"{tools}/observe", {"depth": "png16"})
    for index in range(2):
        rgb = np.frombuffer(raw["arrays"][index]["rgb"], np.uint8).reshape(*SHAPE, 3)
        assert np.array_equal(rgb, np.array(Image.open(io.BytesIO(files["images"][index]["png"]))))
        depth_m = np.frombuffer(raw["arrays"][index]["depth_float16"], "<f2").reshape(SHAPE).astype(float)
        depth_mm = np.array(Image.open(io.BytesIO(files["arrays"][index]["depth_png16"])))
        seen = depth_mm > 0
        assert np.allclose(depth_m[seen], depth_mm[seen] / 1000, rtol=2**-10, atol=0.001)
        assert np.isinf(depth_m[~seen]).all()
    pixels = [[int(u), int(v)] for u, v in np.random.default_rng(0).integers(0, (320, 240), (50, 2))]
    points = call(f"{tools}/query_depth", {"robot": "B", "pixels": pixels})["points"]
    camera = raw["cameras"][1]
    w, x, y, z = camera["camera_in_pelvis"]["quaternion_wxyz"]
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    rows = np.array([[np.inf if cell is None else cell for cell in row] for row in points], float)
    measured = (rows[:, 2:] - camera["camera_in_pelvis"]["position_m"]) @ axis
    expected = depth_m[tuple(np.array(pixels).T[::-1])]
    seen = np.isfinite(expected)
    assert np.allclose(expected[seen], measured[seen], rtol=2**-10, atol=0.001)


def check_chunks(tools):
    """Checks that one call steps and returns the observation, and that a repeated call steps only once."""
    state = call(f"{tools}/observe", {})
    for number in range(5):
        chunks = [{"robot": robot["robot"], "rows": standing_rows(robot, 20).tolist()} for robot in state["states"]]
        body = {"robots": chunks, "expected_step": state["step"], "observe": {"images": "rgb"}}
        key = {"idempotency-key": str(uuid.uuid4())}
        reply = call(f"{tools}/send_joint_chunk", body, **key)
        assert call(f"{tools}/send_joint_chunk", body, **key) == reply
        assert reply["step"] == 20 * (number + 1) and len(reply["observation"]["arrays"]) == 2
        state = {"step": reply["step"], **reply["observation"]}
    try:
        call(f"{tools}/send_joint_chunk", body)
    except RuntimeError as refusal:
        assert "409" in str(refusal) and "stands at step 100" in str(refusal), refusal
    else:
        raise AssertionError("a command on an old view was executed")


def check_operators(server):
    """Checks two clients, each with one robot, in lockstep."""
    started, tools = start(server, operators="per_robot", talk=True, patience_s=20)
    steps = {}

    def drive(robot, token):
        for _ in range(10):
            seen = call(f"{tools}/observe", {}, token)
            assert [state["robot"] for state in seen["states"]] == [robot]
            rows = standing_rows(seen["states"][0], 10).tolist()
            call(f"{tools}/say", {"text": f"{robot} is ready."}, token)
            reply = call(f"{tools}/send_joint_chunk", {"robots": [{"robot": robot, "rows": rows}]}, token)
            assert [partner["did"] for partner in reply["partners"]] == ["acted"]
            steps.setdefault(robot, []).append(reply["step"])

    operators = [threading.Thread(target=drive, args=(one["robot"], one["token"])) for one in started["operators"]]
    [operator.start() for operator in operators]
    [operator.join() for operator in operators]
    assert steps == {robot: list(range(10, 101, 10)) for robot in "AB"}, steps


def check(server):
    _, tools = start(server)
    check_pictures(tools)
    check_chunks(tools)
    check_operators(server)
    print("fine")


if __name__ == "__main__":
    check(sys.argv[1])
