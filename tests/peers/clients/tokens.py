"""Counts the tokens that a language model reads and writes in an episode of Handover in which it uses every tool.

    pip install -r tests/peers/clients/tokens.txt
    tandem serve &
    python tests/peers/clients/tokens.py http://127.0.0.1:8700 [--mcp]

The episode is scripted after those of language models: a look at everything, then rounds of looking, measuring, asking what can be
reached, and commanding. A server whose tools take `short` is asked for short replies, as its texts advise a model. Pictures are not
counted: every host prices them in its own way. The vocabulary is OpenAI's o200k, which the package carries; those of other hosts differ by
some percent. With a limit as a further argument, more tokens than that are an error.
"""

import json
import os
import sys

import bpe_openai
import requests

URL = sys.argv[1].rstrip("/")
LIMIT = int(sys.argv[2]) if len(sys.argv) > 2 else None
TOKEN = os.environ.get("TANDEM_TOKEN")
ENCODING = bpe_openai.get_encoding("o200k_base")
RIGHT = [1, 0, 0, 0]
OPEN, CLOSED = [0, 0.3, 0, 0, 0, 0, 0], [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3]


def tokens(value):
    return len(ENCODING.encode(json.dumps(value, separators=(",", ":"), ensure_ascii=False)))


def without_pictures(reply):
    if isinstance(reply, dict):
        return {name: without_pictures(value) for name, value in reply.items() if name not in ("images", "arrays")}
    if isinstance(reply, list):
        return [without_pictures(item) for item in reply]
    return reply


class Counter:
    def __init__(self):
        self.session = requests.Session()
        if TOKEN:
            self.session.headers["authorization"] = f"Bearer {TOKEN}"
        self.counts = {}
        specs = self.session.get(f"{URL}/v1/tools?format=anthropic").json()
        self.short = {spec["name"] for spec in specs if "short" in spec["input_schema"]["properties"]}
        self.tools = {spec["name"] for spec in specs}
        self.note("(the list of tools)", {}, specs)

    def note(self, tool, arguments, reply):
        count = self.counts.setdefault(tool, [0, 0])
        count[0] += 1
        count[1] += tokens(arguments) + tokens(without_pictures(reply))

    def call(self, tool, **arguments):
        if tool in self.short:
            arguments["short"] = True
        if tool == "list_tasks":
            answer = self.session.get(f"{URL}/v1/tasks", params={"short": "true"} if tool in self.short else None)
        elif tool == "start_episode":
            answer = self.session.post(f"{URL}/v1/episodes", json=arguments)
        else:
            answer = self.session.post(f"{URL}/v1/episodes/{self.episode}/tools/{tool}", json=arguments)
            arguments = {"episode_id": self.episode, **arguments}
        reply = answer.json()
        if not answer.ok:
            sys.exit(f"{tool} {arguments}: {reply}")
        if tool == "start_episode":
            self.episode = reply["episode_id"]
        self.note(tool, arguments, reply)
        return reply

    def table(self):
        for tool, (calls, count) in sorted(self.counts.items(), key=lambda entry: -entry[1][1]):
            print(f"{tool:22} {calls:4} calls {count:8} tokens, {count / calls:7.0f} each")
        total = sum(count for _, count in self.counts.values())
        print(f"{'in all':22} {sum(calls for calls, _ in self.counts.values()):4} calls {total:8} tokens")
        return total


def hand(robot, position_m, fingers=None):
    move = {"robot": robot, "right_position_m": position_m, "right_quaternion_wxyz": RIGHT}
    return {**move, "right_fingers_rad": fingers} if fingers else move


def look_around(counter, robot):
    """Calls of a model that looks for an object: an image, a coarse grid, a fine one, and a check of its reach."""
    counter.call("observe", robots=[robot])
    counter.call("query_depth", robot=robot, region={"from": [40, 100], "to": [280, 220], "stride": 20})
    counter.call("query_depth", robot=robot, region={"from": [140, 150], "to": [200, 210], "stride": 6})
    counter.call("query_depth", robot=robot, pixels=[[160, 170], [162, 174], [170, 180]])
    counter.call("check_reach", robot=robot, right_position_m=[0.26, -0.2, 0.14], right_quaternion_wxyz=RIGHT)


def reach(counter, steps_m, robot, fingers):
    for position_m in steps_m:
        counter.call("move_wrists", steps=25, robots=[hand(robot, position_m, fingers)])
        counter.call("wait", steps=10)


def play(counter):
    counter.call("list_tasks")
    counter.call("start_episode", task="handover", seed=int(os.environ.get("SEED", "2000")))
    for robot in "AB":
        look_around(counter, robot)
        counter.call("get_robot_state", robot=robot)
    reach(counter, [[0.12, -0.3, 0.2], [0.22, -0.3, 0.16], [0.24, -0.24, 0.16]], "A", OPEN)
    look_around(counter, "A")
    reach(counter, [[0.24, -0.22, 0.16]], "A", CLOSED)
    counter.call("get_robot_state", robot="A")
    reach(counter, [[0.24, -0.22, 0.2], [0.26, -0.2, 0.24]], "A", None)
    counter.call("get_status")
    for _ in range(4):
        counter.call("walk", steps=20, robots=[{"robot": "B", "vx_m_s": 0.1, "vy_m_s": 0, "yaw_rate_rad_s": 0}])
    look_around(counter, "B")
    reach(counter, [[0.2, -0.3, 0.22], [0.26, -0.26, 0.22]], "B", OPEN)
    both = [hand("A", [0.28, -0.18, 0.24]), hand("B", [0.28, -0.24, 0.24], CLOSED)]
    for _ in range(4):
        counter.call("move_wrists", steps=25, robots=both)
    look_around(counter, "B")
    row = [0.6, 0.2, 0.2, -1, 0, 0, 0, 0.6, -0.2, -0.2, -1, 0, 0, 0] + [0] * 17 + [0, 0, 0, 0.75]
    counter.call("send_joint_chunk", robots=[{"robot": "A", "rows": [row] * 3}])
    reach(counter, [[0.24, -0.2, 0.2], [0.24, -0.2, 0.16]], "B", None)
    reach(counter, [[0.2, -0.3, 0.2]], "B", OPEN)
    counter.call("get_status")
    counter.call("finish")


def main():
    counter = Counter()
    play(counter)
    if LIMIT is not None and (total := counter.table()) > LIMIT:
        sys.exit(f"{total} tokens, more than {LIMIT}")
    if LIMIT is None:
        counter.table()


main()
