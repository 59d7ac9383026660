"""Language models whose agent is killed. They continue in another process without a difference."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import TracebackType
from typing import Any, TypeAlias

import pytest
from scripted_endpoint import Says, Script, ScriptedEndpoint

import tandem
from tandem.agent import main
from tandem.agent.journal import LineFile

APIS = ("openai", "openai-chat", "anthropic")
KEY = "sk-test-0123456789abcdef"
# The folder of the sources is avoided, because Python would import it as the package.
AWAY = Path(__file__).parent
SEED = 2000


@pytest.fixture(autouse=True)
def keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY"):
        monkeypatch.setenv(name, KEY)
    for name in ("OPENAI_BASE_URL", "ANTHROPIC_BASE_URL", "ANTHROPIC_AUTH_TOKEN", "TANDEM_EPISODE", "TANDEM_TOKEN"):
        monkeypatch.delenv(name, raising=False)


class Relay:
    """Stands between an agent and its server, and keeps the Idempotency-Key of each request that has one.

    kill: Is asked about every request whether the agent is killed with it, before the server gets it ("before") or when the
        server has answered ("after"), and not ("").
    """

    def __init__(self, url: str, kill: Callable[[str], str]) -> None:
        self.keys: list[tuple[str, str]] = []
        self.agent: subprocess.Popen[str] | None = None
        self._upstream = url.removeprefix("http://")
        self._kill = kill
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self.url = f"http://127.0.0.1:{self._server.server_port}"

    def __enter__(self) -> Relay:
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._server.shutdown()
        self._server.server_close()

    def _pass_on(self, handler: BaseHTTPRequestHandler) -> None:
        body = handler.rfile.read(int(handler.headers.get("content-length") or 0))
        path, key = handler.path, handler.headers.get("idempotency-key")
        if key is not None and path != "/v1/episodes":
            self.keys.append((path.rpartition("/")[2], key))
        when = self._kill(path)
        if when == "before":
            kill(self.agent)
            return
        upstream = HTTPConnection(self._upstream, timeout=60)
        upstream.request(handler.command, path, body, dict(handler.headers.items()))
        response = upstream.getresponse()
        content = response.read()
        upstream.close()
        if when == "after":
            kill(self.agent)
            return
        handler.send_response(response.status)
        for name in ("content-type", "retry-after"):
            if value := response.getheader(name):
                handler.send_header(name, value)
        if response.status != 204:
            handler.send_header("content-length", str(len(content)))
        handler.end_headers()
        handler.wfile.write(content)

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        relay = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                relay._pass_on(self)

            def do_POST(self) -> None:
                relay._pass_on(self)

            def do_DELETE(self) -> None:
                relay._pass_on(self)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        return Handler


def kill(agent: subprocess.Popen[str] | None) -> None:
    assert agent is not None
    agent.send_signal(signal.SIGKILL)
    agent.wait()


def start(endpoint: ScriptedEndpoint, url: str, api: str, *flags: str) -> subprocess.Popen[str]:
    where = ["--api", api, "--base-url", endpoint.base_url(api), "--url", url]
    command = [sys.executable, "-m", "tandem.agent", *where, *flags]
    return subprocess.Popen(command, cwd=AWAY, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def begin(endpoint: ScriptedEndpoint, url: str, api: str, runs: Path, *flags: str) -> subprocess.Popen[str]:
    """Starts an agent that begins an episode."""
    episode = ["--model", "scripted", "--task", "handover", "--seed", str(SEED), "--runs", str(runs)]
    return start(endpoint, url, api, *episode, *flags)


def latest(runs: Path) -> Path:
    """The folder of the episode that an agent began last."""
    return max(runs.glob("handover-*/agent.json"), key=lambda path: path.stat().st_mtime_ns).parent


def result(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "result.json").read_text())


def script(_: str) -> Script:
    """Looks, waits and ends: replies with thoughts, pictures, several calls, a mistake, and without a call."""
    yield Says(thoughts="Where am I?", words="I look.", calls=(("observe", {"robots": ["A"]}), ("get_status", {})))
    yield Says(words="I wait.", calls=(("wait", {"steps": 5}), ("wait", {"steps": 99}), ("wait", {"steps": 7})))
    yield Says(words="Well.")
    yield Says(thoughts="On.", calls=(("wait", {"steps": 3}),))
    yield Says(words="Done.", calls=(("finish", {}),))


def told(endpoint: ScriptedEndpoint) -> list[str]:
    """The requests to the model, without the time that an agent has left."""
    left = re.compile(r'wall_clock_left_s\\*":[0-9.]+|[0-9]+ seconds to think')
    return [left.sub("", json.dumps(request.body)) for request in endpoint.requests]


def summary(folder: Path) -> dict[str, Any]:
    """The outcome of an episode after any number of resumptions."""
    came = result(folder)
    usage = {name: came["usage"][name] for name in ("input_tokens", "output_tokens", "cached_tokens", "endings", "models")}
    return {**{name: came[name] for name in ("ended", "env_steps", "tool_calls", "phases", "falls")}, "usage": usage}


Unbroken: TypeAlias = Callable[[str], tuple[list[str], dict[str, Any], list[str]]]
"""By API, the requests of an uninterrupted episode, its outcome, and the tools that it called."""


@pytest.fixture(scope="module")
def unbroken(server: tandem.Server, runs: Path) -> Unbroken:
    plays: dict[str, tuple[list[str], dict[str, Any], list[str]]] = {}

    def play(api: str) -> tuple[list[str], dict[str, Any], list[str]]:
        if api not in plays:
            with ScriptedEndpoint(script) as endpoint, Relay(server.url, lambda path: "") as relay:
                agent = begin(endpoint, relay.url, api, runs)
                _, errors = agent.communicate(timeout=120)
                assert agent.returncode == 0, errors
            called = [tool for tool, _ in relay.keys if tool != "notes"]
            plays[api] = (told(endpoint), summary(latest(runs)), called)
        return plays[api]

    return play


Moment: TypeAlias = tuple[int, str, str]
"""Moment of the kill: the n-th request whose path contains this part, before or after it reaches the server."""

MOMENTS: dict[str, Moment] = {
    "before the first reply is told of": (1, "/notes", "before"),
    "when the first reply's thought is noted": (1, "/notes", "after"),
    "when the first reply is noted": (2, "/notes", "after"),
    "before the first call": (1, "/tools/", "before"),
    "after the first call": (1, "/tools/observe", "after"),
    "before a command": (1, "/tools/wait", "before"),
    "after a command": (1, "/tools/wait", "after"),
    "after a refusal": (2, "/tools/wait", "after"),
    "before the end": (1, "/tools/finish", "before"),
}


def at(moment: Moment) -> Callable[[str], str]:
    """Returns the function by which Relay decides whether a request kills the agent."""
    count, part, when = moment
    seen = iter(range(1, 1000))
    return lambda path: when if part in path and next(seen) == count else ""


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_killed_agent_goes_on_as_if_it_had_not_been(
    moment: str, server: tandem.Server, runs: Path, unbroken: Unbroken
) -> None:
    api = APIS[list(MOMENTS).index(moment) % len(APIS)]
    requests, came, called = unbroken(api)
    with ScriptedEndpoint(script) as endpoint, Relay(server.url, at(MOMENTS[moment])) as relay:
        relay.agent = begin(endpoint, relay.url, api, runs)
        relay.agent.communicate(timeout=120)
        assert relay.agent.returncode == -signal.SIGKILL
        folder = latest(runs)
        relay.agent = start(endpoint, relay.url, api, "--resume", str(folder))
        printed, errors = relay.agent.communicate(timeout=120)
    assert relay.agent.returncode == 0, errors
    assert told(endpoint) == requests
    assert summary(folder) == came
    assert "taken up again after" in printed and "finished: p1 not reached" in printed
    keys = dict.fromkeys((tool, key) for tool, key in relay.keys if tool != "notes")
    assert [tool for tool, _ in keys] == called


@pytest.mark.parametrize(("api", "answers"), [("openai", True), ("openai-chat", False), ("anthropic", True)])
def test_a_model_is_asked_again_whose_reply_nobody_read(
    api: str,
    answers: bool,
    server: tandem.Server,
    runs: Path,
    unbroken: Unbroken,
) -> None:
    requests, came, _ = unbroken(api)
    with ScriptedEndpoint(script) as endpoint:
        reply, asked = endpoint.answer, iter(range(1000))

        def answer(path: str, body: dict[str, Any], headers: dict[str, str]) -> tuple[int, dict[str, Any]]:
            is_killed = next(asked) == 2
            replied = reply(path, body, headers) if answers or not is_killed else (418, dict[str, Any]())
            if is_killed:
                kill(agent)
            return replied

        endpoint.answer = answer
        agent = begin(endpoint, server.url, api, runs)
        agent.communicate(timeout=120)
        folder = latest(runs)
        agent = start(endpoint, server.url, api, "--resume", str(folder))
        _, errors = agent.communicate(timeout=120)
    assert agent.returncode == 0, errors
    assert told(endpoint) == requests
    assert summary(folder) == came


def test_kills_at_any_moment_leave_the_play_as_it_was(server: tandem.Server, runs: Path, unbroken: Unbroken) -> None:
    requests, came, called = unbroken("anthropic")
    draw = random.Random(SEED)

    def at_random(path: str) -> str:
        # An episode cannot be resumed before anybody knows its id.
        return draw.choice(("before", "after", *[""] * 8)) if path.startswith("/v1/episodes/") else ""

    with ScriptedEndpoint(script) as endpoint, Relay(server.url, at_random) as relay:
        relay.agent = begin(endpoint, relay.url, "anthropic", runs)
        relay.agent.communicate(timeout=120)
        folder, kills = latest(runs), 0
        while relay.agent.returncode == -signal.SIGKILL:
            kills += 1
            relay.agent = start(endpoint, relay.url, "anthropic", "--resume", str(folder))
            relay.agent.communicate(timeout=120)
    assert (relay.agent.returncode, kills > 3) == (0, True)
    assert told(endpoint) == requests
    assert summary(folder) == came
    keys = dict.fromkeys((tool, key) for tool, key in relay.keys if tool != "notes")
    assert [tool for tool, _ in keys] == called


class Pair:
    """A script for each robot, which sends its name to the other. Stores the messages."""

    def __init__(self) -> None:
        self.heard: list[str] = []

    def script(self, system: str) -> Script:
        robot = "A" if "the humanoid robot A" in system else "B"
        answers = yield Says(calls=(("say", {"text": f"I am {robot}."}), ("wait", {"steps": 5})))
        self.heard.extend(answer.text for answer in answers)
        yield Says(calls=(("wait", {"steps": 5}),))
        yield Says(calls=(("finish", {}),))

    def check(self, folder: Path, endpoint: ScriptedEndpoint) -> None:
        """Checks that each call was executed and each message received once."""
        came = result(folder)
        assert (came["ended"], came["env_steps"], len(endpoint.requests)) == ("finished", 310, 6)
        said = ["I am A.", "I am B."]
        assert [sum(words in text for text in self.heard) for words in said] == [1, 1]


@pytest.mark.parametrize("moment", [(1, "/tools/wait", "after"), (2, "/tools/say", "after"), (1, "/tools/finish", "after")])
def test_a_model_for_each_robot_is_taken_up_again(moment: Moment, server: tandem.Server, runs: Path) -> None:
    pair = Pair()
    with ScriptedEndpoint(pair.script) as endpoint, Relay(server.url, at(moment)) as relay:
        relay.agent = begin(endpoint, relay.url, "openai-chat", runs, "--per-robot", "--talk")
        relay.agent.communicate(timeout=120)
        folder = latest(runs)
        relay.agent = start(endpoint, relay.url, "openai-chat", "--resume", str(folder))
        printed, errors = relay.agent.communicate(timeout=120)
    assert relay.agent.returncode == 0, errors
    pair.check(folder, endpoint)
    # If both robots had finished before the kill, the episode has ended.
    goes_on = "A: taken up again after" in printed or "B: taken up again after" in printed
    assert goes_on or (moment[1] == "/tools/finish" and "the episode has ended already" in printed)
    assert sorted({tool for tool, _ in set(relay.keys)} - {"notes"}) == ["finish", "say", "wait"]
    assert len({key for tool, key in relay.keys if tool == "wait"}) == 4


def break_off(command: list[str], endpoint: ScriptedEndpoint, runs: Path, killed: str) -> str:
    """Starts an agent with its own server, kills the agent or both at the third reply, and returns their last output."""
    reply, asked = endpoint.answer, iter(range(1000))

    def answer(path: str, body: dict[str, Any], headers: dict[str, str]) -> tuple[int, dict[str, Any]]:
        replied = reply(path, body, headers)
        if next(asked) == 2:
            if killed == "both":
                os.killpg(agent.pid, signal.SIGKILL)
            else:
                events = (latest(runs) / "agent.jsonl").read_text().splitlines()
                os.kill(json.loads(events[0])["pid"], signal.SIGKILL)
        return replied

    endpoint.answer = answer
    episode = ["--model", "scripted", "--api", "openai-chat", "--task", "handover", "--seed", str(SEED), "--runs", str(runs)]
    agent = subprocess.Popen([*command, *episode], cwd=AWAY, start_new_session=True, stderr=subprocess.PIPE, text=True)
    return agent.communicate(timeout=120)[1]


@pytest.mark.parametrize(("program", "killed"), [("tandem", "both"), ("tandem", "agent"), ("tandem.agent", "both")])
def test_an_agent_whose_server_is_killed_with_it_goes_on(program: str, killed: str, tmp_path: Path, unbroken: Unbroken) -> None:
    requests, came, _ = unbroken("openai-chat")
    program_and_flags = ["tandem", "agent"] if program == "tandem" else [program]
    with ScriptedEndpoint(script) as endpoint:
        command = [sys.executable, "-m", *program_and_flags, "--base-url", endpoint.base_url("openai-chat")]
        errors = break_off(command, endpoint, tmp_path, killed)
        assert ("the agent was killed; tandem agent --resume" in errors) == (killed == "agent")
        folder = latest(tmp_path)
        assert subprocess.run([*command, "--resume", str(folder)], cwd=AWAY, timeout=120, check=False).returncode == 0
    assert told(endpoint) == requests
    assert summary(folder) == came


def test_a_model_for_each_robot_goes_on_on_another_server(tmp_path: Path) -> None:
    pair = Pair()
    with ScriptedEndpoint(pair.script) as endpoint:
        command = [sys.executable, "-m", "tandem", "agent", "--base-url", endpoint.base_url("openai-chat")]
        break_off([*command, "--per-robot", "--talk"], endpoint, tmp_path, "both")
        folder = latest(tmp_path)
        assert subprocess.run([*command, "--resume", str(folder)], cwd=AWAY, timeout=120, check=False).returncode == 0
    pair.check(folder, endpoint)


@pytest.fixture(scope="module")
def broken_off(server: tandem.Server, runs: Path) -> Path:
    """The folder of an episode whose agent was killed before its first command."""
    with ScriptedEndpoint(script) as endpoint, Relay(server.url, at((1, "/tools/wait", "before"))) as relay:
        relay.agent = begin(endpoint, relay.url, "openai-chat", runs, "--temperature", "0.5", "--max-calls", "9")
        relay.agent.communicate(timeout=120)
    return latest(runs)


def refusal(capsys: pytest.CaptureFixture[str], *flags: str) -> str:
    assert main([*flags]) == 1
    return capsys.readouterr().err


def test_what_cannot_be_resumed_says_what_could(
    broken_off: Path, server: tandem.Server, runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = refusal(capsys, "--resume", str(runs / "handover-seed9"))
    assert "there is no folder" in missing and f"have: {broken_off}" in missing
    (runs / "empty").mkdir(exist_ok=True)
    assert "it is no folder of an agent's episode; have: " in refusal(capsys, "--resume", str(runs / "empty"))
    resume = ("--resume", str(broken_off), "--url", server.url)
    told = refusal(capsys, *resume, "--model", "other", "--seed", "3", "--per-robot", "--top-p", "0.9")
    for says in ("--model other (it was scripted)", "--seed 3 (it was 2000)", "--per-robot True (it was not given)", "--top-p"):
        assert says in told
    assert "--scene room.xml (it was not given)" in refusal(capsys, *resume, "--server-flags", '{"scene": "room.xml"}')
    assert "--runs" in refusal(capsys, *resume, "--runs", str(tmp_path))
    elsewhere = tmp_path / broken_off.name
    elsewhere.mkdir()
    kept = json.loads((broken_off / "agent.json").read_text())
    (elsewhere / "agent.json").write_text(json.dumps({**kept, "format": 0, "tandem": "0.0.9"}))
    assert "was kept by Tandem 0.0.9" in refusal(capsys, "--resume", str(elsewhere))
    (elsewhere / "agent.json").write_text(json.dumps(kept)[:-9])
    assert "cannot be read" in refusal(capsys, "--resume", str(elsewhere))
    renamed = elsewhere.rename(tmp_path / "renamed")
    (renamed / "agent.json").write_text(json.dumps(kept))
    assert f"was called {broken_off.name}" in refusal(capsys, "--resume", str(renamed))
    with tandem.serve(runs=tmp_path) as other:
        told = refusal(capsys, "--resume", str(broken_off), "--url", other.url)
    assert f"the server does not hold {broken_off.name}" in told and "play the task anew" in told


def test_nobody_else_reads_what_an_agent_keeps_and_no_key_is_in_it(broken_off: Path) -> None:
    files = list(broken_off.glob("agent*"))
    assert sorted(path.name for path in files) == ["agent.json", "agent.jsonl"]
    for path in files:
        assert path.stat().st_mode & 0o777 == 0o600
        assert KEY not in path.read_text()


def test_a_conversation_is_one_process_s(broken_off: Path, server: tandem.Server, capsys: pytest.CaptureFixture[str]) -> None:
    lines = LineFile(broken_off / "agent.jsonl")
    told = refusal(capsys, "--resume", str(broken_off), "--url", server.url)
    assert "is another process's (" in told and "wait until that has ended" in told
    lines.close()


def test_limits_may_change_and_an_episode_that_has_ended_gives_its_result(
    broken_off: Path, server: tandem.Server, capsys: pytest.CaptureFixture[str]
) -> None:
    # The line that a process was writing when it was killed.
    with (broken_off / "agent.jsonl").open("a") as file:
        file.write('{"event":"replied","reply":{"wo')
    resume = ["--resume", str(broken_off), "--url", server.url]
    with ScriptedEndpoint(script) as endpoint:
        flags = ["--base-url", endpoint.base_url("openai-chat"), "--max-calls", "3", "--temperature", "0.5"]
        assert main([*resume, *flags, "--model", "scripted", "--task", "handover", "--seed", str(SEED)]) == 0
        assert endpoint.requests == []
    printed = capsys.readouterr().out
    assert "stopped: all of --max-calls 3 were made" in printed
    came = result(broken_off)
    assert (came["env_steps"], came["usage"]["endings"][0]["ending"]) == (305, "call_limit")
    calls = [call for call in tandem.Recording(broken_off / "episode.mcap").calls if call.tool == "wait"]
    assert len(calls) == 1
    assert main(resume) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("the episode has ended already\nfinished: p1 not reached")


def test_a_play_that_cannot_be_kept_goes_on(
    server: tandem.Server, runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(file: LineFile, value: Any) -> None:
        raise OSError(28, "No space left on device")

    episode = ["--model", "scripted", "--api", "openai-chat", "--task", "handover", "--seed", str(SEED), "--url", server.url]
    with ScriptedEndpoint(script) as endpoint:
        where = ["--base-url", endpoint.base_url("openai-chat")]
        assert main([*episode, *where, "--runs", str(tmp_path)]) == 0
        assert "--resume cannot take it up" in capsys.readouterr().err
        endpoint.restart()
        monkeypatch.setattr(LineFile, "append", full)
        assert main([*episode, *where, "--runs", str(runs)]) == 0
    printed = capsys.readouterr().err
    assert printed.count("No space left on device; the play goes on, and --resume cannot take it up") == 1
    folder = max(runs.glob("handover-*/result.json"), key=lambda path: path.stat().st_mtime_ns).parent
    assert not (folder / "agent.json").exists()
