"""Teams of language models: each robot has its own model, with its own endpoint, prices and limits."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from inspect_ai.log import read_eval_log
from scripted_endpoint import CACHED_TOKENS, INPUT_TOKENS, OUTPUT_TOKENS, Says, Script, ScriptedEndpoint

import tandem
from tandem.agent import main
from tandem.export.inspect_log import export_inspect

# The folder of the sources is avoided, because Python would import it as the package.
AWAY = Path(__file__).parent
SEED = 2000
PRICE_A = "usd-per-million-input=10&usd-per-million-output=100&usd-per-million-cached=1"
PRICE_B = "usd-per-million-input=1&usd-per-million-output=2"
USD_A = ((INPUT_TOKENS - CACHED_TOKENS) * 10 + CACHED_TOKENS + OUTPUT_TOKENS * 100) / 1e6
USD_B = (INPUT_TOKENS + OUTPUT_TOKENS * 2) / 1e6


@pytest.fixture(autouse=True)
def keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (
        "OPENAI_API_KEY",
        "ANTHROPIC_API_KEY",
        "OPENAI_BASE_URL",
        "ANTHROPIC_BASE_URL",
        "TANDEM_EPISODE",
        "TANDEM_TOKEN",
    ):
        monkeypatch.delenv(name, raising=False)


def latest(runs: Path) -> Path:
    """The folder of the latest episode."""
    return max(runs.glob("handover-*/agent.json"), key=lambda path: path.stat().st_mtime_ns).parent


def waiting(times: int) -> Script:
    for _ in range(times):
        yield Says(words="I wait.", calls=(("wait", {"steps": 5}),))
    yield Says(calls=(("finish", {}),))


def flags(common: ScriptedEndpoint, own: ScriptedEndpoint, options: str = "") -> list[str]:
    """The flags for a model of A in one API, and for B in another."""
    model = f"B=other?api=anthropic&base-url={own.base_url('anthropic')}&{PRICE_B}{options}"
    prices = [f"--{price}" for price in PRICE_A.split("&")]
    where = ["--api", "openai-chat", "--base-url", common.base_url("openai-chat")]
    return ["--model", "scripted", *where, *prices, "--per-robot", "--robot-model", model]


def check_usage(usage: dict[str, Any], replies: tuple[int, int]) -> None:
    """Tests that usage and costs are given for each model and in sum."""
    assert sorted(usage["models"]) == ["other", "scripted"]
    assert usage["input_tokens"] == sum(replies) * INPUT_TOKENS
    assert math.isclose(usage["usd"], replies[0] * USD_A + replies[1] * USD_B)
    parts = {part["robot"]: part for part in usage["robots"]}
    assert [(parts[robot]["model"], parts[robot]["input_tokens"]) for robot in "AB"] == [
        ("scripted", replies[0] * INPUT_TOKENS),
        ("other", replies[1] * INPUT_TOKENS),
    ]
    assert math.isclose(parts["A"]["usd"], replies[0] * USD_A) and math.isclose(parts["B"]["usd"], replies[1] * USD_B)


def test_each_robot_has_its_model_and_its_price(server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with ScriptedEndpoint(lambda _: waiting(2)) as common, ScriptedEndpoint(lambda _: waiting(4)) as own:
        play = [*flags(common, own, "&max-calls=3"), "--url", server.url, "--runs", str(runs), "--max-calls", "20"]
        assert main([*play, "--task", "handover", "--seed", str(SEED)]) == 0
    # B's own limit ends its play after three calls; the limit of the command holds for A.
    assert [request.path for request in common.requests] == ["/v1/chat/completions"] * 3
    assert [request.path for request in own.requests] == ["/v1/messages"] * 3
    assert {request.body["model"] for request in own.requests} == {"other"}
    assert "You direct the humanoid robot B in" in own.requests[0].system
    printed = capsys.readouterr().out
    assert f"{3 * USD_A:.4f} US dollars" in printed and f"{3 * USD_B:.4f} US dollars" in printed
    assert "B: stopped: all of --max-calls 3 were made" in printed
    folder = latest(runs)
    check_usage(json.loads((folder / "result.json").read_text())["usage"], (3, 3))
    page = (folder / "report.html").read_text()
    assert f'<td>B</td><td class="long">other</td><td class="number">{3 * INPUT_TOKENS} tokens read</td>' in page
    begun = [json.loads((folder / f"agent-{robot}.jsonl").read_text().splitlines()[0]) for robot in "AB"]
    assert [each["settings"]["model"] for each in begun] == ["scripted", "other"]
    assert [each["settings"]["limits"]["calls"] for each in begun] == [20, 3]


def test_a_team_goes_on_with_the_same_models(server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Kills the first process while B's model thinks."""

    def thinking(_: str) -> Script:
        yield Says(calls=(("wait", {"steps": 5}),))
        program.kill()
        program.wait()
        yield Says(calls=(("finish", {}),))

    episode = ["--task", "handover", "--seed", str(SEED), "--url", server.url, "--runs", str(runs)]
    with ScriptedEndpoint(lambda _: waiting(2)) as common, ScriptedEndpoint(thinking) as own:
        command = [sys.executable, "-m", "tandem.agent", *flags(common, own), *episode]
        program = subprocess.Popen(command, cwd=AWAY, stdout=subprocess.DEVNULL)
        program.wait(timeout=120)
        resume = ["--resume", str(latest(runs)), "--url", server.url]
        assert main([*resume, "--robot-model", "B=third"]) == 1
        assert "--model of B's model third (it was other)" in capsys.readouterr().err
        assert main([*resume, "--robot-model", "A=third"]) == 1
        assert "--model of A's model third (it was not given)" in capsys.readouterr().err
        anew = f"B=other?base-url={own.base_url('anthropic')}&max-calls=9"
        assert main([*resume, "--robot-model", anew]) == 0
    assert "B: taken up again after 1 replies and 1 calls" in capsys.readouterr().out
    folder = latest(runs)
    check_usage(json.loads((folder / "result.json").read_text())["usage"], (3, 2))
    models = json.loads((folder / "agent.json").read_text())["flags"]["robot_models"]
    assert models["B"]["model"] == "other"


REFUSED = {
    "--robot-model other": "for example B=MODEL",
    "--robot-model B=m?key=1": "unrecognized arguments: --key=1",
    "--robot-model B=m?api=grpc": "invalid choice",
}


@pytest.mark.parametrize("given", REFUSED)
def test_what_is_no_model_of_a_robot_is_told_what_is(given: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--model", "m", "--per-robot", *given.split()])
    assert REFUSED[given] in capsys.readouterr().err


def test_models_that_cannot_play_begin_no_episode(
    server: tandem.Server, runs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = set(runs.iterdir())
    play = ["--model", "m", "--base-url", "http://127.0.0.1:9", "--task", "handover", "--url", server.url]
    checks = {
        "--per-robot --robot-model C=m?base-url=http://127.0.0.1:9": "has no robot 'C' for --robot-model; have: A, B",
        "--robot-model B=m?base-url=http://127.0.0.1:9": "--robot-model needs --per-robot",
        "--per-robot --robot-model B=m": "set OPENAI_API_KEY",
        "--per-robot --robot-model B=m?max-usd=1": "--robot-model B=m: --max-usd needs prices",
    }
    for given, says in checks.items():
        assert main([*play, *given.split()]) == 1
        assert says in capsys.readouterr().err
    assert set(runs.iterdir()) == before


def test_an_evaluation_plays_teams_and_keeps_their_conversations(tmp_path: Path) -> None:
    with ScriptedEndpoint(lambda _: waiting(2)) as common, ScriptedEndpoint(lambda _: waiting(2)) as own:
        team = flags(common, own)[-3:]
        policy = f"agent:scripted?api=openai-chat&base-url={common.base_url('openai-chat')}&{PRICE_A}"
        command = [sys.executable, "-m", "tandem", "evaluate", "--policy", policy, *team]
        out = ["--tasks", "handover", "--seeds", str(SEED), "--out", str(tmp_path / "run")]
        program = subprocess.run([*command, *out], cwd=AWAY, capture_output=True, text=True)
    assert program.returncode == 0, program.stderr
    (played,) = json.loads((tmp_path / "run" / "results.json").read_text())["episodes"]
    assert played["policy"] == "agent:scripted B=other per robot"
    check_usage(played["usage"], (3, 3))
    (folder,) = (tmp_path / "run" / "episodes").glob(f"handover*{SEED}/")
    begun = [json.loads((folder / robot / "agent.jsonl").read_text().splitlines()[0]) for robot in "AB"]
    assert [each["settings"]["model"] for each in begun] == ["scripted", "other"]
    (log,) = export_inspect(tmp_path / "run", tmp_path / "logs")
    assert (log.task, log.model, log.samples) == ("handover", "scripted + other", 1)
    (sample,) = read_eval_log(log.path).samples or []
    assert (sample.id, list(sample.role_usage)) == (SEED, ["A", "B"])


def test_the_program_knows_the_flag() -> None:
    for command in ("agent", "evaluate"):
        told = subprocess.run([sys.executable, "-m", "tandem", command, "--help"], cwd=AWAY, capture_output=True, text=True)
        assert re.search(r"--robot-model <ROBOT=MODEL>", told.stdout), told.stdout
