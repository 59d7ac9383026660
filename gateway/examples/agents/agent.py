"""A minimal agent with Python's standard library alone: every robot lifts its right hand by 10 cm, then the agent finishes.

    tandem evaluate --policy exec:"python3 gateway/examples/agents/agent.py" --tasks handover --seeds 0 --out runs/agent

With --per-robot it is started for each robot, and lifts only that robot's hand.
"""

import json
import os
import sys
import urllib.request

EPISODE = f"{os.environ['TANDEM_URL']}/v1/episodes/{os.environ['TANDEM_EPISODE']}"
RISE_M = 0.1
NEAR_M = 0.01
MAX_COMMANDS = 8


def call(tool, **arguments):
    headers = {"content-type": "application/json", "authorization": f"Bearer {os.environ['TANDEM_TOKEN']}"}
    request = urllib.request.Request(f"{EPISODE}/tools/{tool}", json.dumps(arguments).encode(), headers)
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def raised(robot):
    """Returns the pose of a robot's right wrist, 10 cm higher."""
    wrist = call("get_robot_state", robot=robot)["right_wrist"]
    x, y, z = wrist["position_m"]
    return {"robot": robot, "right_position_m": [x, y, z + RISE_M], "right_quaternion_wxyz": wrist["quaternion_wxyz"]}


def main():
    print(sys.stdin.read())  # the brief: what a language model would be told
    with open(os.environ["TANDEM_START"], encoding="utf-8") as file:
        start = json.load(file)
    steps = start["status"]["budget"]["steps_per_command"]
    mine = os.environ.get("TANDEM_ROBOT")
    targets = [raised(robot["robot"]) for robot in start["robots"] if mine in (None, robot["robot"])]
    for _ in range(MAX_COMMANDS):
        reports = call("move_wrists", steps=steps, robots=targets)["robots"]
        if all(report["right"]["position_error_m"] < NEAR_M for report in reports):
            break
    for report in reports:
        print(report["robot"], report["right"]["position_error_m"], report["right"]["measured"])
    print(call("finish"))


main()
