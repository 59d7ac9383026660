"""Results of episodes: recordings, evaluations, reports; and the command line."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tandem


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tandem.ResultReply]:
    folder = tmp_path_factory.mktemp("episode")
    with tandem.Episode("handover", 2006, record=folder) as episode:
        episode.walk(20, [tandem.WalkMove("A", 0.3, 0.0, 0.0)])
        with pytest.raises(tandem.Refused):
            episode.wait(10_000)
        with pytest.raises(tandem.TandemError, match="forward only"):
            episode.restore(episode.snapshot())
        return folder, episode.finish()


def test_a_recording_is_arrays(recorded: tuple[Path, tandem.ResultReply]) -> None:
    folder, result = recorded
    recording = tandem.Recording(folder)
    steps, robots, objects = len(recording), len(recording.robots), len(recording.objects)
    assert (recording.task, recording.seed, recording.result) == ("handover", 2006, result)
    assert steps == result.env_steps + 1
    assert recording.state_hashes[-1] == result.state_hash
    assert recording.robots == ("A", "B")
    assert "bottle" in recording.objects
    for array, shape in [
        (recording.q_rad, (robots, 43)),
        (recording.torque_n_m, (robots, 43)),
        (recording.actions, (robots, 35)),
        (recording.pelvis_in_world, (robots, 7)),
        (recording.wrists_in_pelvis, (robots, 2, 7)),
        (recording.hand_force_n, (robots, 2, 3)),
        (recording.objects_in_world, (objects, 7)),
        (recording.contact_force_n, (robots, 2, objects, 3, 3)),
    ]:
        assert array.shape == (steps, *shape)
        assert array.dtype == np.float32
        assert np.isfinite(array).all()
    assert np.allclose(np.diff(recording.time_s), 0.02)
    assert not recording.fallen.any()
    went = np.linalg.norm(recording.pelvis_in_world[-1, :, :2] - recording.pelvis_in_world[0, :, :2], axis=-1)
    assert went[0] > 0.03 > went[1]
    assert recording.actions[-1, 0, recording.action_columns.index("vx_m_s")] == pytest.approx(0.3)
    tools = [(call.tool, call.problem is None) for call in recording.calls]
    assert tools == [("walk", True), ("wait", False), ("finish", True)]


def test_pictures_are_drawn_on_demand(recorded: tuple[Path, tandem.ResultReply]) -> None:
    recording = tandem.Recording(recorded[0] / "episode.mcap")
    assert recording.cameras == ("third_person", "A", "B")
    first, last = recording.picture("A", 0), recording.picture("A", -1)
    assert first.rgb.shape == (240, 320, 3)
    assert first.depth_m.shape == (240, 320)
    assert not np.array_equal(first.rgb, last.rgb)
    with tandem.Episode("handover", 2006) as episode:
        seen = episode.observe().rgb["A"]
        assert np.array_equal(seen, recording.picture("A", episode.briefing.status.env_steps).rgb)
    assert recording.picture("third_person", 5, size=(64, 48)).rgb.shape == (48, 64, 3)
    with pytest.raises(tandem.TandemError, match="have: third_person, A, B"):
        recording.picture("C", 0)
    with pytest.raises(IndexError, match="have 0 to"):
        recording.picture("A", 10_000)


def test_damage_is_said(recorded: tuple[Path, tandem.ResultReply], tmp_path: Path) -> None:
    content = bytearray((recorded[0] / "episode.mcap").read_bytes())
    content[len(content) // 2] ^= 1
    damaged = tmp_path / "episode.mcap"
    damaged.write_bytes(content)
    with pytest.raises(tandem.TandemError, match="no whole recording"):
        tandem.Recording(damaged)
    with pytest.raises(tandem.TandemError, match="cannot read"):
        tandem.Recording(tmp_path / "none.mcap")


def walk_a_little(episode: tandem.Episode) -> None:
    assert episode.seed is not None
    if episode.seed == 2009:
        raise ValueError("no plan for this seed")
    for _ in range(1 + episode.seed % 2):
        episode.walk(10, [tandem.WalkMove("A", 0.2, 0.0, 0.0)])


def test_a_callable_is_evaluated(tmp_path: Path) -> None:
    told: list[tandem.ResultReply] = []

    def run(jobs: int, out: Path | None) -> tandem.Evaluation:
        return tandem.evaluate(
            walk_a_little,
            "handover",
            range(2007, 2010),
            jobs,
            protocol="benchmark",
            assistance="full",
            out=out,
            progress=told.append,
        )

    kept = run(2, tmp_path)
    assert len(told) == 3
    summary = kept.tasks["handover"]
    assert (summary.episodes, summary.p1, summary.policy_failed) == (2, 0, 1)
    assert [result.ended for result in kept.results] == ["finished", "finished", "policy_failed"]
    assert [result.env_steps for result in kept.results] == [20, 10, 0]
    assert "p1" in (kept.notes[0] or "")
    assert "ValueError: no plan for this seed" in (kept.notes[2] or "")
    again = run(1, None)
    assert [result.state_hash for result in again.results] == [result.state_hash for result in kept.results]
    assert again.folder is None
    page = tandem.report(tmp_path)
    assert "walk_a_little" in page.read_text()
    text = tandem.report(tmp_path, format="md", out=tmp_path / "table.md").read_text()
    assert "handover" in text
    with pytest.raises(tandem.TandemError):
        tandem.report(tmp_path / "nothing")
    with pytest.raises(tandem.TandemError, match="have: handover"):
        tandem.evaluate(walk_a_little, "handove", 2007)
    with pytest.raises(tandem.TandemError, match="no `tasks`; name the file's task by its id"):
        tandem.evaluate(walk_a_little, task_file="own.toml")


def test_episodes_are_rows_of_parquet(tmp_path: Path) -> None:
    parquet: Any = pytest.importorskip("pyarrow.parquet")
    kept = tandem.evaluate(walk_a_little, "handover", range(2007, 2010), protocol="benchmark", assistance="full", out=tmp_path)
    head = tandem.report(tmp_path, format="episodes.csv").read_text().splitlines()[0]
    table = parquet.read_table(tandem.report(tmp_path, format="episodes.parquet"))
    assert table.column_names == head.split(",")
    assert table["seed"].to_pylist() == [2007, 2008, 2009]
    assert table["steps"].to_pylist() == [20, 10, 0]
    assert table["counted"].to_pylist() == [True, True, False]
    assert table["state_hash"].to_pylist() == [result.state_hash for result in kept.results]
    assert (table["p1_s"].null_count, str(table["p1_s"].type)) == (3, "double")


def test_a_scored_episode_cannot_be_undone_or_known_again(tmp_path: Path) -> None:
    snapshots: list[tandem.Snapshot] = []
    with tandem.Episode("handover", 2011, protocol="benchmark", assistance="paper") as own:
        snapshots.append(own.snapshot())

    def cheat(episode: tandem.Episode) -> None:
        with pytest.raises(tandem.TandemError, match="an evaluation scores this episode"):
            episode.snapshot()
        episode.wait(5)
        with pytest.raises(tandem.TandemError, match="forward only"):
            episode.restore(snapshots[0])
        status = episode.get_status()
        assert (episode.seed, status.seed, status.state_hash) == (None, None, None)
        with pytest.raises(tandem.TandemError, match="no hash"):
            assert episode.state_hash
        told = episode.finish()
        assert (told.seed, told.state_hash) == (None, None)

    played = tandem.evaluate(cheat, "handover", 2011, protocol="benchmark", out=tmp_path)
    assert [(result.ended, result.env_steps, result.seed) for result in played.results] == [("finished", 5, 2011)]
    assert played.notes[0] == "p1 was not reached in 5 steps"


def test_a_key_draws_what_seeds_mean(tmp_path: Path) -> None:
    def played(key: str | None, seeds: range = range(1, 3)) -> tandem.Evaluation:
        file = tmp_path / "key.txt"
        if key is not None:
            file.write_text(key)
        return tandem.evaluate("idle", "handover", seeds, protocol="benchmark", seed_key=file if key is not None else None)

    public, keyed, again, other = (
        played(None),
        played("0123456789abcdef\n"),
        played("0123456789abcdef"),
        played("0123456789abcdeg"),
    )
    hashes = [[result.state_hash for result in run.results] for run in (public, keyed, again, other)]
    assert [result.seed for result in keyed.results] == [1, 2]
    assert hashes[1] == hashes[2]
    assert len({*hashes[0], *hashes[1], *hashes[3]}) == 6
    named = [[what for what in run.raw["departures"] if what.startswith("seed key: ")] for run in (public, keyed, again, other)]
    assert [len(names) for names in named] == [0, 1, 1, 1]
    assert named[1] == named[2] != named[3]
    with pytest.raises(tandem.TandemError, match="has 4 bytes; give 16 or more"):
        played("0123")
    with pytest.raises(tandem.TandemError, match="cannot read the seed key"):
        tandem.evaluate("idle", "handover", 1, seed_key=tmp_path / "nothing")


def test_a_policy_that_raises_leaves_its_recordings_whole(tmp_path: Path) -> None:
    def policy(episode: tandem.Episode) -> None:
        episode.wait(5)
        raise ValueError("no plan for this seed")

    failed = tandem.evaluate(policy, "handover", 2007, out=tmp_path, record=True)
    with pytest.raises(ValueError, match="no plan"), tandem.Episode("handover", 2007, record=tmp_path / "alone") as episode:
        policy(episode)
    for folder, ended in ((tmp_path / "episodes/handover-2007", "policy_failed"), (tmp_path / "alone", "finished")):
        recording = tandem.Recording(folder)
        assert recording.result is not None
        assert recording.result.ended == ended
        assert recording.state_hashes[-1] == recording.result.state_hash
        assert not list(folder.glob("*.partial"))
    assert failed.tasks["handover"].policy_failed == 1


def test_a_policy_that_cannot_play_is_told_of_once_and_stopped(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    begun: list[int | None] = []

    def broken(episode: tandem.Episode) -> None:
        begun.append(episode.seed)
        raise AttributeError("no weights")

    with pytest.raises(tandem.TandemError, match=r"failed alike in the first 3 episodes .AttributeError: no weights"):
        tandem.evaluate(broken, "handover", range(2000, 2009), out=tmp_path, assistance="full")
    assert begun == [2000, 2001, 2002]
    printed = capsys.readouterr().err
    assert printed.count("Traceback") == 1 and "in broken" in printed


def test_seeds_may_be_numbers_of_numpy() -> None:
    def policy(episode: tandem.Episode) -> None:
        episode.wait(1)

    played = tandem.evaluate(policy, "handover", np.arange(2007, 2009))
    assert [result.seed for result in played.results] == [2007, 2008]
    assert tandem.Episode("handover", np.int64(2007)).seed == 2007  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="more than 100000 seeds"):
        tandem.evaluate(policy, "handover", range(2**32))
    with pytest.raises(TypeError, match="give a whole number"):
        tandem.Episode("handover", 1.5)  # pyright: ignore[reportArgumentType]


def test_players_are_named_and_collected(tmp_path: Path) -> None:
    shown = tandem.collect("handover", 2007, out=tmp_path, protocol="benchmark")
    played = tandem.evaluate("expert", "handover", 2007, protocol="benchmark", assistance="full")
    assert shown.tasks["handover"].p3 == played.tasks["handover"].p3 == 1
    assert (
        shown.results[0].state_hash
        == played.results[0].state_hash
        == tandem.Recording(tmp_path / "episodes/handover-2007").state_hashes[-1]
    )
    with pytest.raises(tandem.TandemError, match="have: expert, no_words, idle"):
        tandem.evaluate("nobody", "handover", 2007)  # pyright: ignore[reportArgumentType]
    with pytest.raises(tandem.TandemError, match="leave `name` out"):
        tandem.evaluate("expert", "handover", 2007, name="mine")
    with pytest.raises(TypeError, match="have: name, protocol"):
        tandem.evaluate("expert", "handover", 2007, seed=3)  # pyright: ignore[reportCallIssue]


def test_other_threads_run_while_physics_does() -> None:
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.wait(0.001):
            counted += 1

    with tandem.Episode("handover", 2000) as episode:
        thread = threading.Thread(target=count)
        thread.start()
        before = counted
        for _ in range(20):
            episode.wait(25)
        during = counted - before
        done.set()
        thread.join()
    # Each of these calls takes many milliseconds; had they held Python's lock, the other thread would count between them only.
    assert during > 20


def test_the_command_line_is_whole(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    demo = subprocess.run(
        [sys.executable, "-m", "tandem", "demo", "--seeds", "2010", "--runs", str(tmp_path)],
        # The folder of the sources is avoided, because Python would import it as the package.
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert demo.returncode == 0, demo.stderr
    assert "p3 place reached" in demo.stdout
    assert tandem.main(["replay", "--verify", str(tmp_path / "handover-seed2010" / "episode.mcap")]) == 0
    assert "verified" in capfd.readouterr().out
    assert tandem.main(["no-such-command"]) == 2
    assert "no-such-command" in capfd.readouterr().err
    assert tandem.main(["--version"]) == 0
    assert capfd.readouterr().out.startswith("tandem ")


ENDLESS = """
import os, sys, tandem

def policy(episode):
    os.write(1, b"begun\\n")  # whole, where `print` of two threads mixes its lines
    while True:
        episode.wait(1)

tandem.evaluate(policy, ["handover", "pouring"], range(2000, 2200), jobs=2, protocol="agentic", out=sys.argv[1], record=True)
"""


def test_an_interrupt_ends_an_evaluation_and_leaves_files_whole(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", ENDLESS, str(tmp_path)],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode != 0
    assert "KeyboardInterrupt" in said
    recordings = list(tmp_path.rglob("episode.mcap"))
    assert recordings
    assert not list(tmp_path.rglob("*.partial"))
    for path in recordings:
        assert len(tandem.Recording(path)) > 1
