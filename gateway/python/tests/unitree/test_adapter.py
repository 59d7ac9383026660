"""A robot of a real episode with topics that the test controls."""

from __future__ import annotations

import json
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("zmq")

import tandem
from tandem_unitree.command_line import parser
from tandem_unitree.exchange import Exchange
from tandem_unitree.link import Access, Link
from tandem_unitree.robot.shared import Robot, RobotSettings
from tandem_unitree.wire.layout import LOW_COMMAND, LOW_STATE, blank, body_of, command_crc, serialized, state_crc

WAIST_YAW, WEIGHT = 12, 29


class Topics:
    """Topics in memory."""

    def __init__(self) -> None:
        self.written: dict[str, list[bytes]] = {}
        self.to_read: dict[str, list[bytes]] = {}

    def write(self, topic: str, message: bytes) -> None:
        self.written.setdefault(topic, []).append(message)

    def take(self, topic: str) -> list[bytes]:
        return self.to_read.pop(topic, [])


@pytest.fixture
def access(tmp_path: Path) -> Iterator[Access]:
    """The access of robot B, whose partner is absent."""
    with tandem.serve(runs=tmp_path) as server:
        body = {"task": "handover", "seed": 0, "operators": "per_robot", "patience_s": 0.05}
        started = tandem.Client(server.url).request("POST", "/v1/episodes", body)
        [token] = [operator["token"] for operator in started["operators"] if operator["robot"] == "B"]
        yield Access(server.url, token)


def turned(robot: Robot, link: Link, exchange: Exchange, steps: int) -> float:
    """Makes control steps like the adapter, and returns the angle of the waist."""
    for _ in range(steps):
        exchange.take()
        assert link.command(robot.commands.row(robot.latest.time_s))
        robot.sensed(link.sense(robot.latest))
        exchange.publish()
    return float(robot.latest.joints[0, 12])


def test_a_robot_follows_its_programs(access: Access) -> None:
    link = Link(access)
    assert link.robot == "B" and link.limits.pelvis_height_m[1] > 0.7
    robot, topics = Robot(RobotSettings("B", 2), link), Topics()
    exchange = Exchange(robot, topics, None)
    command = blank(LOW_COMMAND)
    command["motors"]["q"][WAIST_YAW], command["motors"]["kp"][WAIST_YAW], command["motors"]["q"][WEIGHT] = 0.3, 60, 1
    command["crc"] = command_crc(command)
    topics.to_read["rt/arm_sdk"] = [b"", serialized(command)]
    assert abs(turned(robot, link, exchange, 40) - 0.3) < 0.02
    time.sleep(0.03)
    exchange.publish()
    state = body_of(topics.written["rt/lowstate"][-1], LOW_STATE)
    assert state is not None and state["crc"] == state_crc(state)
    assert np.isclose(state["motors"]["q"][WAIST_YAW], robot.latest.joints[0, 12])
    assert state["tick"] == round(1000 * robot.latest.time_s)
    assert (
        len(topics.written["rt/lf/bmsstate"]) < len(topics.written["rt/dex3/left/state"]) < len(topics.written["rt/lowstate"])
    )


def test_a_call_is_answered_with_its_own_number(access: Access) -> None:
    link = Link(access)
    robot, topics = Robot(RobotSettings("B", 2), link), Topics()
    text = json.dumps({"velocity": [-0.2, 0, 0], "duration": 5}).encode() + b"\0"
    header = b"\0\1\0\0" + struct.pack("<qqqi?3xI", 77, 7105, 0, 0, False, len(text))
    topics.to_read["rt/api/sport/request"] = [header + text + b"\0" * 8, b"\0\1\0\0"]
    exchange = Exchange(robot, topics, None)
    exchange.take()
    [answer] = topics.written["rt/api/sport/response"]
    assert struct.unpack_from("<qqi", answer, 4) == (77, 7105, 0)
    before_m = robot.latest.position_m[0]
    turned(robot, link, exchange, 50)
    assert robot.latest.position_m[0] < before_m - 0.03, "it walks"


def test_commands_of_a_partner_go_on_over_single_steps(tmp_path: Path) -> None:
    with tandem.serve(runs=tmp_path) as server:
        body = {"task": "handover", "seed": 0, "operators": "per_robot", "patience_s": 20}
        started = tandem.Client(server.url).request("POST", "/v1/episodes", body)
        tokens = [str(operator["token"]) for operator in started["operators"]]
        bridge = tandem.Client(server.url, token=tokens[0])
        try:
            bridge.request("POST", "/operate/pace")
        except tandem.Refused as refused:
            pytest.skip(f"the server is of an older build: {refused}")
        tools = f"/v1/episodes/{started['episode_id']}/tools"

        def steps() -> None:
            for _ in range(20):
                bridge.request("POST", f"{tools}/wait", {"steps": 1})

        pacing = threading.Thread(target=steps)
        pacing.start()
        reply = tandem.Client(server.url, token=tokens[1]).request("POST", f"{tools}/wait", {"steps": 20})
        pacing.join()
        assert reply["executed_steps"] == 20


def test_an_episode_that_is_over_is_ended(access: Access, tmp_path: Path) -> None:
    link = Link(access)
    link.note("Robot B is driven by a test.")
    tandem.Client(access.url).request("DELETE", f"/v1/episodes/{link.episode_id}")
    with pytest.raises(tandem.EpisodeEnded):
        link.command(np.zeros(35))
    with pytest.raises(tandem.EpisodeEnded):
        link.sense(None)
    with tandem.serve(runs=tmp_path / "other") as other, pytest.raises(tandem.Refused, match="start another one"):
        Link(Access(other.url, "0" * 40))


def test_the_command_line_says_where_robots_are() -> None:
    given = parser().parse_args(["--task", "handover", "--domains", "A=0,B=7", "--clock", "hold"])
    assert given.domains == {"A": 0, "B": 7} and given.interface == "lo" and given.clock == "hold"
    for wrong in (["--domains", "A"], ["--domains", "A=x"], ["--robots", "D"], ["--clock", "none"]):
        with pytest.raises(SystemExit):
            parser().parse_args(["--task", "handover", *wrong])
