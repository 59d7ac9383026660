"""Language models that play: the loop, through the official SDKs, against a server of episodes and a scripted endpoint."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scripted_endpoint import BESIDE, CACHED_TOKENS, INPUT_TOKENS, OUTPUT_TOKENS, Heard, Refusal, Says, Script, ScriptedEndpoint

import tandem
from tandem.agent import main

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


def run(endpoint: ScriptedEndpoint, server: tandem.Server, api: str = "openai-chat", *flags: str) -> int:
    """Plays an episode of Handover on the server, like the command line."""
    where = ["--api", api, "--base-url", endpoint.base_url(api), "--url", server.url]
    return main(["--model", "scripted", *where, "--task", "handover", "--seed", str(SEED), *flags])


def result(runs: Path) -> dict[str, Any]:
    """The folder of the latest episode."""
    latest = max(runs.glob("handover-*/result.json"), key=lambda path: path.stat().st_mtime_ns)
    return json.loads(latest.read_text())


def observe(robot: str = "A") -> tuple[str, dict[str, Any]]:
    return "observe", {"robots": [robot]}


def saying(*said: Says) -> Callable[[str], Script]:
    """A script that ignores all answers."""

    def script(_: str) -> Script:
        for says in said:
            _heard = yield says

    return script


class Grasp:
    """Takes the bottle at the place where it sees it, and lifts it, by the advice of the brief. Stores the answers."""

    def __init__(self) -> None:
        self.heard: list[list[Heard]] = []

    def script(self, system: str) -> Script:
        assert "the bottle" in system and '"close_rad"' in system
        heard = yield Says(thoughts="Where is the bottle?", words="I look.", calls=(observe(), ("get_status", {})))
        self.heard.append(heard)
        heard = yield Says(calls=(("query_depth", {"robot": "A", "surface": {"color": "green"}}),))
        self.heard.append(heard)
        x, y, z = json.loads(heard[0].text)["surfaces"][0]["centroid_m"]
        # The camera sees the near side, at 0.1 m; the axis is 20 mm behind it.
        away = math.hypot(x - 0.1, y)
        x, y, z = x + 0.02 * (x - 0.1) / away, y + 0.02 * y / away, z - 0.06
        opened, closed = [0, 0.3, 0, 0, 0, 0, 0], [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3]

        def wrist(aside_m: float, up_m: float, fingers: list[float]) -> tuple[str, dict[str, Any]]:
            move: dict[str, Any] = {"robot": "A", "right_position_m": [x - 0.12, y - 0.055 - aside_m, z + up_m]}
            return "move_wrists", {
                "steps": 25,
                "robots": [{**move, "right_quaternion_wxyz": [1, 0, 0, 0], "right_fingers_rad": fingers}],
            }

        approach = (wrist(0.12, 0.1, opened), wrist(0.08, 0.0, opened), wrist(0.0, 0.0, opened), wrist(0.0, 0.0, opened))
        self.heard.append((yield Says(words="I reach for it.", calls=approach)))
        self.heard.append((yield Says(calls=(wrist(0.0, 0.0, closed), wrist(0.0, 0.0, closed)))))
        self.heard.append((yield Says(calls=(wrist(0.0, 0.06, closed), wrist(0.0, 0.1, closed), wrist(0.0, 0.1, closed)))))
        yield Says(words="It is lifted.", calls=(("finish", {}),))


@pytest.mark.parametrize("api", APIS)
def test_a_model_lifts_the_bottle(api: str, server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grasp = Grasp()
    busy = [Refusal(429, "slow down"), Refusal(500, "no idea"), Refusal(529, "overloaded")]
    prices = ["--usd-per-million-input", "10", "--usd-per-million-output", "100", "--usd-per-million-cached", "1"]
    with ScriptedEndpoint(grasp.script, refusals=busy) as endpoint:
        assert run(endpoint, server, api, *prices) == 0
    assert endpoint.refused == [429, 500, 529]
    came = result(runs)
    assert came["phases"]["p1"] is not None
    assert (came["ended"], came["falls"], came["tool_calls"]) == ("finished", 0, 13)
    assert [[heard.pictures for heard in turn] for turn in grasp.heard[:2]] in ([[1, 0], [0]], [[0, 1], [0]])
    assert json.loads(grasp.heard[0][1].text)["task"] == "handover"
    assert [request.pictures for request in endpoint.requests] == [0, 1, 1, 1, 1, 1]
    replies = len(endpoint.requests)
    usd = replies * ((INPUT_TOKENS - CACHED_TOKENS) * 10 + CACHED_TOKENS * 1 + OUTPUT_TOKENS * 100) / 1e6
    printed = capsys.readouterr().out
    assert f"13 calls, {replies} replies, {replies * INPUT_TOKENS} tokens read ({replies * CACHED_TOKENS} cached)" in printed
    assert f"{usd:.4f} US dollars" in printed
    assert "reached: p1 grasp_and_lift" in printed
    assert "thinks: Where is the bottle?" in printed and "says: It is lifted." in printed


@pytest.mark.parametrize("api", APIS)
def test_a_request_says_what_may_be_kept(api: str, server: tandem.Server) -> None:
    look = Says(words="I look.", calls=(observe(),))
    done = Says(calls=(("finish", {}),))
    with ScriptedEndpoint(saying(look, look, look, done)) as endpoint:
        assert run(endpoint, server, api) == 0
    for request in endpoint.requests:
        begun = [request.body[part] for part in ("tools", "instructions", "system") if part in request.body]
        first = endpoint.requests[0].body
        assert begun == [first[part] for part in ("tools", "instructions", "system") if part in first]
        assert '"episode_id"' not in json.dumps(request.body["tools"])
        marks = json.dumps(request.body).count('"cache_control"')
        if api == "anthropic":
            told = [message for message in request.body["messages"] if message["role"] == "user"]
            assert marks == 2 + min(2, len(told))
            assert all("cache_control" in message["content"][-1] for message in told[-2:])
        else:
            assert (request.body["prompt_cache_key"], marks) == ("tandem-handover", 0)
    if api == "openai":
        assert endpoint.requests[0].body["store"] is False
        assert all(tool["strict"] is False for tool in endpoint.requests[0].body["tools"])


def test_thoughts_go_back_as_their_api_wants_them(server: tandem.Server) -> None:
    said = saying(Says(thoughts="Hm.", calls=(("get_status", {}),)), Says(calls=(("finish", {}),)))
    with ScriptedEndpoint(said) as endpoint:
        assert run(endpoint, server, "openai", "--effort", "low") == 0
    assert endpoint.requests[0].body["reasoning"] == {"effort": "low", "summary": "auto"}
    assert [
        item.get("encrypted_content") for item in endpoint.requests[1].body["input"] if item.get("type") == "reasoning"
    ] == ["sealed"]
    with ScriptedEndpoint(said) as endpoint:
        assert run(endpoint, server, "anthropic", "--effort", "low") == 0
    assert endpoint.requests[0].body["output_config"] == {"effort": "low"}
    sent = endpoint.requests[1].body["messages"][1]["content"]
    assert sent[0] == {"type": "thinking", "thinking": "Hm.", "signature": "signed"}


def test_servers_of_chat_completions_get_back_what_they_gave(server: tandem.Server) -> None:
    said = saying(Says(thoughts="Hm.", calls=(("get_status", {}),)), Says(calls=(("finish", {}),)))
    with ScriptedEndpoint(said) as endpoint:
        assert run(endpoint, server) == 0
        sent = endpoint.requests[1].body["messages"][2]
        assert (sent["reasoning_content"], sent["tool_calls"][0]["extra_content"]) == ("Hm.", BESIDE["extra_content"])
        begin = endpoint.answer

        def answer(path: str, body: dict[str, Any], headers: dict[str, str]) -> tuple[int, dict[str, Any]]:
            if any("reasoning_content" in message for message in body["messages"]):
                return 400, {"error": {"message": "messages.2: property 'reasoning_content' is unsupported", "code": None}}
            return begin(path, body, headers)

        endpoint.answer = answer
        endpoint.restart()
        assert run(endpoint, server) == 0


def test_what_an_endpoint_does_not_know_is_left_out(server: tandem.Server) -> None:
    said = saying(Says(calls=(("get_status", {}),)), Says(calls=(("finish", {}),)))
    with ScriptedEndpoint(said, unknown=("prompt_cache_key", "include", "store")) as endpoint:
        assert run(endpoint, server, "openai") == 0
    assert endpoint.refused == [400, 400, 400]
    assert len(endpoint.requests) == 2


@pytest.mark.parametrize("api", APIS)
def test_wrong_calls_are_answered_with_advice(api: str, server: tandem.Server, runs: Path) -> None:
    heard: list[Heard] = []

    def script(_: str) -> Script:
        calls: list[tuple[str, dict[str, Any] | str]] = [("wait", {"steps": 26})]
        calls += [("wait", {"steps": "ten"}), ("fly", {})]
        if api != "anthropic":
            calls += [("wait", "{steps: 10"), ("wait", "[10]")]
        heard.extend((yield Says(calls=tuple(calls))))
        yield Says(calls=(("wait", {"steps": 10}), ("finish", {}), ("wait", {"steps": 10})))

    with ScriptedEndpoint(script) as endpoint:
        assert run(endpoint, server, api) == 0
    assert all(each.refused in (True, None) for each in heard)
    for each, says in zip(heard, ("1 to 25", "steps", "have: observe, ", "no JSON", "no JSON object"), strict=False):
        assert says in each.text
    came = result(runs)
    assert (came["ended"], came["env_steps"]) == ("finished", 310)


def test_a_model_that_calls_nothing_is_asked_once_more(
    server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wait = Says(calls=(("wait", {"steps": 5}),))
    with ScriptedEndpoint(saying(Says("Well."), wait, Says(cut=True), Says("I would rather not."))) as endpoint:
        assert run(endpoint, server) == 0
    told = [request.body["messages"][-1]["content"] for request in endpoint.requests]
    assert "You have called no tool" in told[1]
    assert "cut off" in told[3]
    assert len(told) == 4
    came = result(runs)
    assert came["ended"] == "finished"
    assert came["usage"]["endings"] == [{"ending": "silent", "text": "I would rather not."}]
    assert "stopped: the model called no tool" in capsys.readouterr().out


@pytest.mark.parametrize("api", APIS)
def test_a_model_that_refuses_is_no_model_that_finished(
    api: str, server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wait, refuse = Says(calls=(("wait", {"steps": 5}),)), Says(refusal="I will not move robots.")
    with ScriptedEndpoint(saying(wait, refuse)) as endpoint:
        assert run(endpoint, server, api) == 0
    assert "stopped: the model refused: I will not move robots." in capsys.readouterr().out
    came = result(runs)
    assert came["usage"]["endings"] == [{"ending": "refused", "text": "I will not move robots."}]
    assert (came["ended"], len(endpoint.requests)) == ("finished", 2)


@pytest.mark.parametrize("api", ["openai", "openai-chat"])
def test_a_filter_holds_a_reply_back(api: str, server: tandem.Server, runs: Path) -> None:
    with ScriptedEndpoint(saying(Says(filtered=True))) as endpoint:
        assert run(endpoint, server, api) == 0
    assert result(runs)["usage"]["endings"][0]["ending"] == "content_filter"
    filtered = Refusal(400, "The response was filtered due to the prompt triggering the content management policy.")
    with ScriptedEndpoint(saying(), refusals=[filtered]) as endpoint:
        assert run(endpoint, server, api) == 0
    assert result(runs)["usage"]["endings"][0]["ending"] == "content_filter"


def test_a_terminal_does_not_obey_a_model(server: tandem.Server, capsys: pytest.CaptureFixture[str]) -> None:
    with ScriptedEndpoint(saying(Says(words="\x1b[2Jgone", calls=(("finish", {}),)))) as endpoint:
        assert run(endpoint, server) == 0
    printed = capsys.readouterr().out
    assert "says: \ufffd[2Jgone" in printed and "\x1b" not in printed


def test_what_the_episode_ends_by_is_how_the_model_ended(server: tandem.Server, runs: Path) -> None:
    with ScriptedEndpoint(saying(Says(words="Enough.", calls=(("finish", {}),)))) as endpoint:
        assert run(endpoint, server) == 0
    assert result(runs)["usage"]["endings"] == [{"ending": "finished", "text": ""}]


BROKEN: dict[str, Any] = {
    "an object": {"object": "chat.completion"},
    "a choice without a message": {"choices": [{"index": 0, "finish_reason": "stop", "message": None}]},
    "a list": [1, 2],
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_endpoint_gives_a_line(
    what: str, server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with ScriptedEndpoint(saying()) as endpoint:
        endpoint.answer = lambda path, body, headers: (200, BROKEN[what])
        assert run(endpoint, server) == 1
    printed = capsys.readouterr().err
    assert printed.startswith("tandem agent: ") and printed.count("\n") == 1, printed
    assert result(runs)["usage"]["endings"][0]["ending"] == "endpoint"


def test_sampling_is_asked_for_and_kept(server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--temperature", "0.2", "--top-p", "0.9", "--extra-body", '{"top_k": 40}']
    with ScriptedEndpoint(saying(Says(calls=(("finish", {}),)))) as endpoint:
        assert run(endpoint, server, "openai-chat", *flags, "--sampling-seed", "7") == 0
    body = endpoint.requests[0].body
    assert [body[name] for name in ("temperature", "top_p", "seed", "top_k")] == [0.2, 0.9, 7, 40]
    for api in ("openai", "anthropic"):
        assert main(["--model", "m", "--api", api, "--sampling-seed", "7"]) == 1
        assert "takes no --sampling-seed" in capsys.readouterr().err
    assert main(["--model", "m", "--extra-body", '{"api_key": "secret"}']) == 1
    assert "secret" not in capsys.readouterr().err


LIMITS = {
    "--max-tokens-total 3500": (3, "the next reply would pass --max-tokens-total 3500"),
    "--max-usd 0.035 --usd-per-million-input 10 --usd-per-million-output 0": (3, "the next reply would pass --max-usd 0.035"),
    "--max-calls 2": (2, "all of --max-calls 2 were made"),
    "--max-seconds 0": (0, "--max-seconds 0 are over"),
}


@pytest.mark.parametrize("flags", LIMITS)
def test_limits_finish_the_episode(flags: str, server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    replies, says = LIMITS[flags]
    with ScriptedEndpoint(saying(*[Says(calls=(("wait", {"steps": 1}),))] * 9)) as endpoint:
        assert run(endpoint, server, "openai-chat", *flags.split()) == 0
    assert len(endpoint.requests) == replies
    assert says in capsys.readouterr().out
    came = result(runs)
    assert (came["ended"], came["env_steps"]) == ("finished", 300 + replies)


def test_an_endpoint_that_does_not_count_is_estimated(server: tandem.Server, capsys: pytest.CaptureFixture[str]) -> None:
    with ScriptedEndpoint(saying(*[Says(calls=(observe(),))] * 9)) as endpoint:
        begin = endpoint.answer

        def answer(path: str, body: dict[str, Any], headers: dict[str, str]) -> tuple[int, dict[str, Any]]:
            status, reply = begin(path, body, headers)
            return status, {**reply, "usage": None}

        endpoint.answer = answer
        assert run(endpoint, server, "openai-chat", "--max-tokens-total", "30000") == 0
    assert 2 <= len(endpoint.requests) <= 5
    assert "--max-tokens-total 30000" in capsys.readouterr().out


def test_no_call_is_made_beyond_the_limit(server: tandem.Server, runs: Path) -> None:
    with ScriptedEndpoint(saying(Says(calls=(("wait", {"steps": 1}),) * 5))) as endpoint:
        assert run(endpoint, server, "openai-chat", "--max-calls", "3") == 0
    assert result(runs)["env_steps"] == 303


def test_a_long_conversation_keeps_instructions_and_the_latest_pictures(server: tandem.Server) -> None:
    look, wait = Says(calls=(observe("A"), observe("B"))), Says(words="I wait.", calls=(("wait", {"steps": 1}),))
    with ScriptedEndpoint(saying(*[look] * 13, wait, Says(calls=(("finish", {}),)))) as endpoint:
        assert run(endpoint, server) == 0
    assert [request.pictures for request in endpoint.requests] == [0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 10, 12, 14, 14]
    told = [message for message in endpoint.requests[-1].body["messages"] if message["role"] == "tool"]
    assert ["no longer shown" in message["content"] for message in told] == [True] * 12 + [False] * 15

    with ScriptedEndpoint(saying(*[wait] * 6, Says(calls=(("finish", {}),)))) as endpoint:
        assert run(endpoint, server, "openai-chat", "--context-tokens", str(INPUT_TOKENS - 1)) == 0
    systems = {request.system for request in endpoint.requests}
    assert len(systems) == 1
    last = endpoint.requests[-1].body["messages"]
    assert len(last) == 6
    assert "What you did before" in last[1]["content"]
    assert last[1]["content"].count('- wait {"steps": 1} -> {"executed_steps":1') == 4


def test_a_conversation_that_an_endpoint_finds_too_long_is_cut(server: tandem.Server, runs: Path) -> None:
    wait = Says(words="I wait.", calls=(("wait", {"steps": 1}),))
    with ScriptedEndpoint(saying(*[wait] * 4, Says(calls=(("finish", {}),)))) as endpoint:
        begin = endpoint.answer

        def answer(path: str, body: dict[str, Any], headers: dict[str, str]) -> tuple[int, dict[str, Any]]:
            if len(body["messages"]) > 6:
                return 400, {"error": {"message": "This model's maximum context length is 8192 tokens.", "code": None}}
            return begin(path, body, headers)

        endpoint.answer = answer
        assert run(endpoint, server) == 0
    assert result(runs)["env_steps"] == 304


def test_an_endpoint_that_refuses_is_told_without_its_key(
    server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = Refusal(401, f"Incorrect API key provided: {KEY}. (sk-te****cdef)")
    with ScriptedEndpoint(saying(), refusals=[wrong]) as endpoint:
        assert run(endpoint, server) == 1
    printed = capsys.readouterr()
    assert "answers 401: Incorrect API key provided" in printed.err
    assert "sk-te" not in printed.err + printed.out
    assert result(runs)["ended"] == "finished"
    assert not [path for path in runs.rglob("*") if path.is_file() and KEY.encode() in path.read_bytes()]
    monkeypatch.delenv("OPENAI_API_KEY")
    assert main(["--model", "m", "--task", "handover", "--url", server.url]) == 1
    assert "set OPENAI_API_KEY" in capsys.readouterr().err
    with ScriptedEndpoint(saying(Says(calls=(("finish", {}),)))) as endpoint:
        assert run(endpoint, server) == 0, "an endpoint of one's own needs no key"
    assert main(["--model", "m", "--task", "handover", "--base-url", "http://me:secret@host/v1"]) == 1
    assert "secret" not in capsys.readouterr().err


def test_wrong_flags_and_missing_packages_say_what_would_work(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    checks = {
        "--max-usd 1": "--max-usd needs prices",
        "--usd-per-million-input 1": "together",
        "--task handover --base-url localhost:11434": "give one as http://127.0.0.1:11434/v1",
        "": "give --task, as handover",
    }
    for flags, says in checks.items():
        assert main(["--model", "m", *flags.split()]) == 1
        assert says in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "anthropic", None)
    assert main(["--model", "m", "--api", "anthropic"]) == 1
    assert "pip install 'tandem-sim[agents]'" in capsys.readouterr().err


def test_the_program_knows_the_flags_that_say_which_model_plays(capsys: pytest.CaptureFixture[str]) -> None:
    def flags(text: str) -> set[str]:
        return set(re.findall(r"--[a-z-]+", text))

    with pytest.raises(SystemExit):
        main(["--help"])
    ours = flags(capsys.readouterr().out) - {"--help", "--task", "--seed", "--url"}
    command = [sys.executable, "-m", "tandem", "agent", "--help"]
    program = subprocess.run(command, cwd=AWAY, capture_output=True, text=True, check=True)
    assert ours <= flags(program.stdout)


def test_a_model_for_each_robot(server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heard: dict[str, str] = {}

    def script(system: str) -> Script:
        robot = "A" if "the humanoid robot A" in system else "B"
        first = yield Says(calls=(("say", {"text": f"I am {robot}."}), ("wait", {"steps": 5})))
        heard[robot] = " ".join(each.text for each in first)
        yield Says(calls=(("wait", {"steps": 5}),))
        yield Says(calls=(("finish", {}),))

    with ScriptedEndpoint(script) as endpoint:
        assert run(endpoint, server, "anthropic", "--per-robot", "--talk") == 0
    assert {request.system.split(",")[0] for request in endpoint.requests} == {
        "You direct the humanoid robot A in a simulation",
        "You direct the humanoid robot B in a simulation",
    }
    came = result(runs)
    assert (came["ended"], came["env_steps"]) == ("finished", 310)
    assert "I am A." in heard["B"]
    assert "I am B." in heard["A"]
    printed = capsys.readouterr().out
    assert "A: wait" in printed
    assert "B: wait" in printed


def test_a_signal_ends_the_episode(server: tandem.Server, runs: Path) -> None:
    asked, over = threading.Event(), threading.Event()

    def script(_: str) -> Script:
        yield Says(calls=(("wait", {"steps": 4}),))
        asked.set()
        over.wait(60)
        yield Says()

    with ScriptedEndpoint(script) as endpoint:
        where = ["--api", "openai-chat", "--base-url", endpoint.base_url("openai-chat"), "--url", server.url]
        command = [sys.executable, "-m", "tandem.agent", "--model", "m", *where, "--task", "handover", "--seed", str(SEED)]
        with subprocess.Popen(command, cwd=AWAY, stderr=subprocess.PIPE, text=True) as program:
            assert asked.wait(60)
            program.terminate()
            told = program.communicate(timeout=60)[1]
        over.set()
    assert (program.returncode, told) == (130, "tandem agent: interrupted\n")
    came = result(runs)
    assert (came["ended"], came["env_steps"]) == ("finished", 304)


def test_words_and_what_they_took_are_kept_with_the_episode(server: tandem.Server, runs: Path) -> None:
    said = saying(
        Says(thoughts="Nothing is urgent.", words="I wait.", calls=(("wait", {"steps": 5}),)), Says(calls=(("finish", {}),))
    )
    prices = ["--usd-per-million-input", "1", "--usd-per-million-output", "2", "--usd-per-million-cached", "0.5"]
    with ScriptedEndpoint(said) as endpoint:
        assert run(endpoint, server, "anthropic", *prices) == 0
    usage = result(runs)["usage"]
    assert (usage["notes"], usage["models"]) == (3, ["scripted"])
    assert usage["input_tokens"] == 2 * INPUT_TOKENS
    assert (usage["output_tokens"], usage["cached_tokens"]) == (2 * OUTPUT_TOKENS, 2 * CACHED_TOKENS)
    assert math.isclose(usage["usd"], 2 * ((INPUT_TOKENS - CACHED_TOKENS) + CACHED_TOKENS * 0.5 + OUTPUT_TOKENS * 2) / 1e6)
    assert usage["model_s"] > 0


def test_an_episode_that_somebody_else_began_is_joined(
    server: tandem.Server, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = saying(Says(words="I wait.", calls=(("wait", {"steps": 3}),)), Says(calls=(("finish", {}),)))
    with tandem.Client(server.url).episode("handover", SEED) as episode, ScriptedEndpoint(said) as endpoint:
        monkeypatch.setenv("TANDEM_URL", server.url)
        monkeypatch.setenv("TANDEM_EPISODE", episode.episode_id)
        where = ["--api", "anthropic", "--base-url", endpoint.base_url("anthropic")]
        assert main(["--model", "scripted", *where]) == 0
        assert episode.get_status().ended == "finished"
        assert episode.get_status().env_steps == 303
    assert "says: I wait." in capsys.readouterr().out
