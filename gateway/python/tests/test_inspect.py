"""Logs of Inspect, read by inspect-ai and compared with their source conversations."""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from inspect_ai.event import CompactionEvent, InfoEvent, ModelEvent, SampleLimitEvent, SpanBeginEvent, ToolEvent
from inspect_ai.log import EvalLog, EvalSample, list_eval_logs, read_eval_log
from inspect_ai.model import ChatMessageAssistant, ChatMessageTool, ContentImage, ContentReasoning
from scripted_endpoint import CACHED_TOKENS, INPUT_TOKENS, OUTPUT_TOKENS, PNG, Refusal, Says, Script, ScriptedEndpoint

import tandem
from tandem.agent import main as play
from tandem.export.command_line import main as export

SEED = 2000


def script(system: str) -> Script:
    """Looks, makes mistakes and ends."""
    robot = "B" if "the humanoid robot B" in system else "A"
    yield Says(thoughts="Where am I?", words="I look.", calls=(("observe", {"robots": [robot]}), ("wait", {"steps": 99})))
    yield Says(words="Well.")
    yield Says(calls=(("wait", {"steps": 5}), ("fly", {})))
    yield Says(words="Done.", calls=(("finish", {}),))


def exported(runs: Path, out: Path) -> dict[str, EvalLog]:
    """Exports and reads the logs, by their models."""
    assert export(["inspect", str(runs), str(out)]) == 0
    logs = [read_eval_log(info, resolve_attachments=True) for info in list_eval_logs(str(out))]
    return {log.eval.model: log for log in logs}


def events(sample: EvalSample, kind: type[Any], robot: str | None = None) -> list[Any]:
    span = "agent" if robot is None else f"{robot}-agent"
    return [event for event in sample.events if isinstance(event, kind) and event.span_id == span]


@pytest.fixture(scope="module")
def team(server: tandem.Server, runs: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, EvalLog]:
    """The folder of an episode of two models, and its log."""
    folder = tmp_path_factory.mktemp("team")
    with (
        ScriptedEndpoint(script) as common,
        ScriptedEndpoint(script, refusals=[Refusal(429, "slow"), Refusal(500, "no")]) as own,
    ):
        flags = ["--model", "scripted", "--api", "openai-chat", "--base-url", common.base_url("openai-chat")]
        flags += ["--temperature", "0.2", "--usd-per-million-input", "10", "--usd-per-million-output", "100", "--per-robot"]
        flags += ["--robot-model", f"B=other?api=anthropic&base-url={own.base_url('anthropic')}"]
        where = ["--url", server.url, "--runs", str(runs), "--task", "handover", "--seed", str(SEED)]
        assert play([*flags, *where]) == 0
    (played,) = [path for path in runs.iterdir() if (path / "agent-B.jsonl").exists()]
    (log,) = exported(played, folder).values()
    return played, log


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_a_log_has_every_message_and_image(team: tuple[Path, EvalLog]) -> None:
    folder, log = team
    assert log.samples is not None
    (sample,) = log.samples
    for robot in "AB":
        kept = lines(folder / f"agent-{robot}.jsonl")
        messages = [message for message in sample.messages if (message.metadata or {}).get("robot") == robot]
        assert messages[0].role == "system" and messages[0].text == kept[0]["instructions"]
        said = [message for message in messages if isinstance(message, ChatMessageAssistant)]
        replies = [event["reply"] for event in kept if event["event"] == "replied"]
        assert [message.text for message in said] == [reply["words"] for reply in replies]
        assert [len(message.tool_calls or []) for message in said] == [len(reply["calls"]) for reply in replies]
        assert isinstance(said[0].content[0], ContentReasoning) and said[0].content[0].reasoning == "Where am I?"
        answers = [event["answer"] for event in kept if event["event"] == "answered"]
        results = [message for message in messages if isinstance(message, ChatMessageTool)]
        assert len(results) == len(answers) == 5
        assert all(message.text.startswith(answer["text"]) for message, answer in zip(results, answers, strict=True))
        assert [message.error is not None for message in results] == [answer["refused"] for answer in answers]
        assert [message.error is not None for message in results] == [False, True, False, True, False]
        images = [part.image for message in results for part in message.content if isinstance(part, ContentImage)]
        pictures = [picture["png_base64"] for answer in answers for picture in answer["pictures"]]
        assert images == [f"data:image/png;base64,{picture}" for picture in pictures]
        assert len(images) == 1 and base64.b64decode(pictures[0]).startswith(PNG)
        assert any("You have called no tool" in message.text for message in messages if message.role == "user")
    # Calls are matched with their answers, although both models use the same numbers.
    asked = [
        call.id for message in sample.messages if isinstance(message, ChatMessageAssistant) for call in message.tool_calls or []
    ]
    assert len(set(asked)) == 10
    assert [message.tool_call_id for message in sample.messages if isinstance(message, ChatMessageTool)] == asked


def test_a_log_has_tokens_prices_times_and_retries(team: tuple[Path, EvalLog]) -> None:
    folder, log = team
    assert log.samples is not None
    (sample,) = log.samples
    assert [event.name for event in sample.events if isinstance(event, SpanBeginEvent)] == ["A", "B"]
    for robot, model, retries in (("A", "scripted", None), ("B", "other", 2)):
        asked: list[ModelEvent] = events(sample, ModelEvent, robot)
        replies = [event for event in lines(folder / f"agent-{robot}.jsonl") if event["event"] == "replied"]
        assert [event.retries for event in asked] == [retries, None, None, None]
        assert [event.output.time for event in asked] == [reply["model_s"] for reply in replies]
        assert {(event.model, event.role) for event in asked} == {(model, robot)}
        assert [len(event.input) for event in asked] == [2, 5, 7, 10]
        assert asked[0].tools[0].name == "observe" and "robots" in asked[0].tools[0].parameters.properties
        assert all(event.completed is not None and event.completed >= event.timestamp for event in asked)
        usage = sample.model_usage[model]
        assert (usage.input_tokens, usage.input_tokens_cache_read) == (4 * (INPUT_TOKENS - CACHED_TOKENS), 4 * CACHED_TOKENS)
        assert (usage.output_tokens, usage.total_tokens) == (4 * OUTPUT_TOKENS, 4 * (INPUT_TOKENS + OUTPUT_TOKENS))
        assert (sample.role_usage or {})[robot] == usage
    usd = 4 * (INPUT_TOKENS * 10 + OUTPUT_TOKENS * 100) / 1e6
    assert sample.model_usage["scripted"].total_cost == pytest.approx(usd)
    assert sample.model_usage["other"].total_cost is None
    called: list[ToolEvent] = events(sample, ToolEvent, "A")
    assert [(event.function, event.arguments) for event in called[1:3]] == [("wait", {"steps": 99}), ("wait", {"steps": 5})]
    assert called[1].error is not None and "1 to 25" in called[1].error.message
    assert sample.events[0].timestamp <= called[0].timestamp <= sample.events[-1].timestamp


def test_a_log_says_what_was_played_and_how_it_is_scored(team: tuple[Path, EvalLog]) -> None:
    folder, log = team
    assert (log.status, log.eval.task, log.eval.model) == ("success", "handover", "scripted + other")
    assert log.eval.model_roles is not None
    assert {robot: role.model for robot, role in log.eval.model_roles.items() if not isinstance(role, list)} == {
        "A": "scripted",
        "B": "other",
    }
    assert log.eval.model_generate_config.temperature == 0.2
    assert log.samples is not None and log.results is not None
    (sample,) = log.samples
    result = json.loads((folder / "result.json").read_text())
    assert (sample.id, sample.epoch, sample.error, sample.limit) == (SEED, 1, None, None)
    assert "passes it straight into" in str(sample.input)
    assert sample.scores is not None
    assert {name: score.value for name, score in sample.scores.items()} == {"success": "I", "p1": "I", "p2": "I", "p3": "I"}
    assert sample.scores["p1"].explanation == "p1 was not reached"
    assert {score.name: score.metrics["accuracy"].value for score in log.results.scores} == dict.fromkeys(sample.scores, 0)
    for name in ("env_steps", "tool_calls", "falls", "ended", "assistance"):
        assert sample.metadata[name] == result[name]
    assert sample.metadata["models"]["B"]["api"] == "anthropic"


def single(endpoint: ScriptedEndpoint, server: tandem.Server, runs: Path, seed: int, *flags: str) -> int:
    where = ["--api", "openai-chat", "--base-url", endpoint.base_url("openai-chat"), "--url", server.url, "--runs", str(runs)]
    return play(["--model", "alone", *where, "--task", "handover", "--seed", str(seed), *flags])


def test_a_log_has_the_episodes_of_a_model_by_seed_and_epoch(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    wait = Says(calls=(("wait", {"steps": 1}),))

    def waiting(_: str) -> Script:
        while True:
            yield wait

    with tandem.serve(runs=runs) as server:
        for seed, limit in ((SEED, "2"), (SEED + 1, "3"), (SEED, "2")):
            with ScriptedEndpoint(waiting) as endpoint:
                assert single(endpoint, server, runs, seed, "--max-calls", limit) == 0
        gone = Refusal(401, "no such model")
        with ScriptedEndpoint(waiting, refusals=[gone]) as endpoint:
            assert single(endpoint, server, runs, SEED + 2) == 1
        # The older half of a conversation is dropped repeatedly.
        with ScriptedEndpoint(waiting) as endpoint:
            assert single(endpoint, server, runs, SEED + 3, "--max-calls", "6", "--context-tokens", str(INPUT_TOKENS - 1)) == 0
    logs = exported(runs, tmp_path / "logs")
    assert list(logs) == ["alone"]
    samples = logs["alone"].samples
    assert samples is not None
    samples.sort(key=lambda sample: (sample.id, sample.epoch))
    played = [(SEED, 1), (SEED, 2), (SEED + 1, 1), (SEED + 2, 1), (SEED + 3, 1)]
    assert [(sample.id, sample.epoch) for sample in samples] == played
    assert logs["alone"].eval.config.epochs == 2
    reached = [(sample.limit.type, sample.limit.limit) for sample in samples if sample.limit is not None]
    assert reached == [("custom", 2), ("custom", 2), ("custom", 3), ("custom", 6)]
    assert any(isinstance(event, SampleLimitEvent) for event in samples[0].events)
    assert samples[3].error is not None and "answers 401" in samples[3].error.message
    dropped: list[CompactionEvent] = events(samples[4], CompactionEvent)
    asked: list[ModelEvent] = events(samples[4], ModelEvent)
    assert len(dropped) == 6 and {event.type for event in dropped} == {"trim"}
    sent = [request.body["messages"] for request in endpoint.requests]
    assert [[message.text for message in event.input[:2]] for event in asked] == [
        [message["content"] for message in messages[:2]] for messages in sent
    ]
    assert [len(event.input) for event in asked] == [len(messages) for messages in sent]
    assert "What you did before" in asked[-1].input[1].text
    assert len(samples[4].messages) == 2 + 2 * 6, "what was dropped is still a message of the sample"


def test_a_model_that_reaches_a_phase_has_its_score(team: tuple[Path, EvalLog], tmp_path: Path) -> None:
    """Phases are in the conversation and in the result."""
    folder = tmp_path / "runs" / "handover-seed1"
    folder.mkdir(parents=True)
    (played,) = team[:1]
    for path in played.iterdir():
        if path.suffix in (".json", ".jsonl"):
            (folder / path.name).write_bytes(path.read_bytes())
    result = json.loads((folder / "result.json").read_text())
    (folder / "result.json").write_text(json.dumps({**result, "seed": 1, "phases": {"p1": 4.5, "p2": None, "p3": None}}))
    conversation = lines(folder / "agent-A.jsonl")
    for event in conversation:
        if event["event"] == "answered":
            event["phases"] = ["p1 grasp_and_lift"]
    (folder / "agent-A.jsonl").write_text("".join(json.dumps(event) + "\n" for event in conversation))
    (log,) = exported(tmp_path / "runs", tmp_path / "logs").values()
    assert log.samples is not None and log.results is not None
    (sample,) = log.samples
    assert sample.id == 1 and sample.scores is not None
    assert (sample.scores["p1"].value, sample.scores["p1"].metadata) == ("C", {"time_s": 4.5})
    assert sample.scores["p1"].explanation == "p1 was reached at 4.50 s of the simulation"
    assert log.results.scores[1].metrics["accuracy"].value == 1
    told: list[InfoEvent] = events(sample, InfoEvent, "A")
    assert [event.data for event in told] == ["reached: p1 grasp_and_lift"]


def test_files_of_format_1_are_exported(team: tuple[Path, EvalLog], tmp_path: Path) -> None:
    """Tests logs without settings, times and retries. The model is the one of the flags."""
    folder = tmp_path / "runs" / team[0].name
    folder.mkdir(parents=True)
    (folder / "result.json").write_bytes((team[0] / "result.json").read_bytes())
    kept = json.loads((team[0] / "agent.json").read_text())
    del kept["flags"]["robot_models"]
    (folder / "agent.json").write_text(json.dumps({**kept, "format": 1}))
    conversation = lines(team[0] / "agent-A.jsonl")
    del conversation[0]["settings"], conversation[0]["at"]
    for event in conversation:
        event.get("reply", {}).pop("retries", None)
    (folder / "agent-A.jsonl").write_text("".join(json.dumps(event) + "\n" for event in conversation))
    (log,) = exported(tmp_path / "runs", tmp_path / "logs").values()
    assert log.samples is not None
    assert (log.eval.model, len(log.samples[0].messages)) == ("scripted", 12)


def test_episodes_without_a_conversation_have_their_calls(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    with tandem.serve(runs=runs) as server, tandem.Client(server.url).episode("handover", SEED) as episode:
        note = {"text": "I wait.", "model": "mine", "tokens": {"input": 1000, "output": 20, "cached": 400}, "usd": 0.5}
        tandem.Client(server.url).request("POST", f"/v1/episodes/{episode.episode_id}/notes", note)
        episode.wait(5)
        with pytest.raises(tandem.Refused):
            episode.wait(99)
        episode.finish()
    (log,) = exported(runs, tmp_path / "logs").values()
    assert log.samples is not None
    (sample,) = log.samples
    assert (sample.id, log.eval.model, sample.metadata["tandem"]) == (SEED, "mine", "recording")
    called: list[ToolEvent] = events(sample, ToolEvent)
    assert [event.function for event in called] == ["wait", "wait", "finish"]
    assert [event.error is not None for event in called] == [False, True, False]
    assert '"executed_steps":5' in str(sample.messages[3].text)
    usage = sample.model_usage["mine"]
    assert (usage.input_tokens, usage.input_tokens_cache_read, usage.output_tokens, usage.total_cost) == (600, 400, 20, 0.5)


def test_a_recorded_team_has_the_calls_of_each_robot(team: tuple[Path, EvalLog], tmp_path: Path) -> None:
    folder = tmp_path / "runs" / team[0].name
    folder.mkdir(parents=True)
    for name in ("episode.mcap", "result.json"):
        (folder / name).write_bytes((team[0] / name).read_bytes())
    (log,) = exported(tmp_path / "runs", tmp_path / "logs").values()
    assert log.samples is not None
    (sample,) = log.samples
    for robot in "AB":
        called: list[ToolEvent] = events(sample, ToolEvent, robot)
        # Tools that do not exist never reach an episode, and only the last operator's finish ends it.
        called = called[:3]
        assert [event.function for event in called] == ["observe", "wait", "wait"]
        assert [event.arguments.get("steps") for event in called] == [None, 99, 5]
        assert [event.error is not None for event in called] == [False, True, False]


def test_a_player_of_an_evaluation_has_its_name(tmp_path: Path) -> None:
    tandem.evaluate("expert", tasks=["pouring"], seeds=[SEED], record=True, out=tmp_path / "run")
    (log,) = exported(tmp_path / "run", tmp_path / "logs").values()
    assert (log.eval.model, log.eval.task) == ("expert", "pouring")
    assert log.results is not None and log.results.scores[0].metrics["accuracy"].value == 1


def test_folders_without_agents_say_what_would_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert export(["inspect", str(tmp_path), str(tmp_path / "logs")]) == 1
    assert "no ended episode of an agent in" in capsys.readouterr().err
    assert export(["inspect", str(tmp_path / "nowhere"), str(tmp_path / "logs")]) == 1
    assert "there is no folder" in capsys.readouterr().err
    folder = tmp_path / "other"
    folder.mkdir()
    (folder / "result.json").write_text("{}")
    (folder / "agent.jsonl").write_text('{"event": "ended"}\n')
    assert export(["inspect", str(tmp_path), str(tmp_path / "logs")]) == 1
    assert "is no conversation of an agent (it does not begin with the event `begun`)" in capsys.readouterr().err


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(sys.modules, "inspect_ai", None)
    assert export(["--check", "inspect", "runs", "logs"]) == 1
    assert "pip install 'tandem-sim[inspect]'" in capsys.readouterr().err
