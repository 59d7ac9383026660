"""Evaluations and rollouts on a cluster of Ray: two nodes on this machine, each with one processor."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from walkers import NotingWalker, fail, walk

import tandem

ray: Any = pytest.importorskip("ray", reason="Ray is not installed: pip install './gateway/python[ray]'")

SEEDS = range(2020, 2026)
EXAMPLE = Path(__file__).parents[2] / "examples/environments/rollouts.py"
NODE = {"num_cpus": 1, "object_store_memory": 100 << 20, "include_dashboard": False}


@pytest.fixture
def cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    # Processes of a cluster search the folder in which this one was started, which contains the sources.
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    cluster = import_module("ray.cluster_utils").Cluster(initialize_head=True, head_node_args=NODE)
    try:
        ray.init(address=cluster.address, log_to_driver=False)
        yield cluster
    finally:
        ray.shutdown()
        cluster.shutdown()


def hashes(evaluation: tandem.Evaluation) -> dict[int | None, str | None]:
    assert len(evaluation.results) == len({result.seed for result in evaluation.results})
    return {result.seed: result.state_hash for result in evaluation.results}


def reported(folder: Path) -> list[Any]:
    """The expected contents of a report, without the times of policies."""
    told = json.loads(tandem.report(folder, format="json").read_text())["policies"]
    for task in (task for policy in told for task in policy["tasks"]):
        del task["effort"]["thought"]
    return told


def lines(path: Path) -> list[list[str]]:
    return [line.split() for line in path.read_text().splitlines()]


def test_a_node_that_dies_loses_no_episode(cluster: Any, tmp_path: Path) -> None:
    import tandem.ray

    doomed = cluster.add_node(**NODE)
    out, told = tmp_path / "out", list[int | None]()

    def progress(result: tandem.ResultReply) -> None:
        told.append(result.seed)
        if len(told) == 2:
            cluster.remove_node(doomed, allow_graceful=False)

    def run(progress: Callable[[tandem.ResultReply], object] | None) -> tandem.Evaluation:
        policy = NotingWalker(tmp_path, doomed.node_id)
        return tandem.ray.evaluate(
            policy,
            "handover",
            SEEDS,
            jobs=2,
            name="walk",
            out=out,
            protocol="benchmark",
            assistance="full",
            progress=progress,
        )

    played = run(progress)
    begun = lines(tmp_path / "begun")
    lost = [seed for seed, node in begun if node == doomed.node_id]
    assert len(lost) == 1, begun
    assert Counter(seed for seed, _ in begun) == Counter([*map(str, SEEDS), *lost])
    assert sorted(seed for seed in told if seed is not None) == list(SEEDS)
    assert [result.seed for result in played.results] == list(SEEDS)
    assert played.left_out == ()
    assert [path.name for path in sorted((out / "episodes").iterdir())] == [f"handover-{seed}.json" for seed in SEEDS]

    alone = tandem.evaluate(walk, "handover", SEEDS, protocol="benchmark", assistance="full", out=tmp_path / "alone")
    assert hashes(played) == hashes(alone)
    assert reported(out) == reported(tmp_path / "alone")
    # Episodes with a result in the folder are not played again, here or on the cluster.
    assert hashes(run(None)) == hashes(alone)
    assert len(lines(tmp_path / "begun")) == len(begun)


def test_what_goes_wrong_with_one_episode_is_said_and_the_others_are_played(cluster: Any, tmp_path: Path) -> None:
    import tandem.ray

    played = tandem.ray.evaluate(fail, "handover", range(2020, 2024), out=tmp_path, assistance="full", retries=1)
    assert [(result.seed, result.ended) for result in played.results] == [
        (2020, "finished"),
        (2022, "policy_failed"),
        (2023, "finished"),
    ]
    assert "ValueError: no plan for this seed" in (played.notes[1] or "")
    assert len(played.left_out) == 1
    assert played.left_out[0].startswith("handover seed 2021: its process was lost")
    with pytest.raises(tandem.TandemError, match="have: handover"):
        tandem.ray.evaluate(fail, "handove", 2020)


def test_demonstrations_come_with_their_recordings(cluster: Any, tmp_path: Path) -> None:
    import tandem.ray

    there = tandem.ray.collect("handover", 2021, out=tmp_path / "there", protocol="benchmark")
    here = tandem.collect("handover", 2021, out=tmp_path / "here", protocol="benchmark")
    assert there.tasks["handover"].p3 == 1
    assert hashes(there) == hashes(here)
    names = [sorted(path.name for path in (tmp_path / who / "episodes/handover-2021").iterdir()) for who in ("there", "here")]
    assert names[0] == names[1]
    recording = tandem.Recording(tmp_path / "there/episodes/handover-2021")
    assert recording.result == there.results[0]
    assert recording.state_hashes == tandem.Recording(tmp_path / "here/episodes/handover-2021").state_hashes


def test_rollouts_by_actors(tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    command = [sys.executable, str(EXAMPLE), "--rounds", "2", "--actors", "2", "--worlds", "2", "--steps", "20"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [line.split(":")[0] for line in done.stdout.splitlines()] == ["round 1", "round 2", "pose of A's right arm"]
