"""Small tests of policies that learn from demonstrations: their inputs, their training, and all steps to a report."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import tandem
from tandem.baselines import PolicyKind, Scope, Sharing, TrainingSettings
from tandem.baselines.command_line import main
from tandem.baselines.data import CLOCK_S, Demonstrations, read
from tandem.baselines.maps import map_text
from tandem.baselines.views import View, views
from tandem.export import ExportSettings, export_lerobot

TINY = TrainingSettings(steps=6, batch=4, hidden=32, keypoints=4, chunk_rows=4, execute_rows=2)


def torch() -> Any:
    return pytest.importorskip("torch", reason="torch is not installed: pip install './gateway/python[baselines]'")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two episodes in which both robots walk and turn in different ways."""
    folder = tmp_path_factory.mktemp("runs")
    for seed in (2010, 2011):
        with tandem.Episode("handover", seed, protocol="benchmark", record=folder / f"handover-{seed}") as episode:
            for turn in (0.4, -0.4, 0.2):
                episode.walk(15, [tandem.WalkMove("A", 0.2, 0.0, turn), tandem.WalkMove("B", 0.0, 0.1, -turn)])
    return folder


@pytest.fixture(scope="module", params=["png", "video"])
def data_set(request: pytest.FixtureRequest, runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("av")
    settings = ExportSettings(images=request.param, size=(80, 60))
    (exported,) = export_lerobot(runs, tmp_path_factory.mktemp("data") / "set", settings, jobs=2)
    return exported.folder


def rotation(quaternion: NDArray[np.float32]) -> NDArray[np.float64]:
    w, x, y, z = quaternion.astype(float)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_moments_are_what_the_recordings_hold(runs: Path, data_set: Path) -> None:
    read_all, every_second = read(data_set, 4, 1), read(data_set, 4, 2)
    assert (read_all.task, read_all.robots, read_all.rate_hz, read_all.size) == ("handover", ("A", "B"), 10, (80, 60))
    assert (len(read_all), len(every_second)) == (18, 10)
    assert np.array_equal(every_second.chunks[5:], read_all.chunks[9::2])
    assert not read_all.validated.any()
    recording = tandem.Recording(runs / "handover-2011")
    for row in (0, 3, 8):
        moment, step = 9 + row, 5 * row
        state = read_all.states[moment]
        assert np.array_equal(state[:, :47], recording.states[step])
        assert state[:, 47] == pytest.approx(step * 0.02 / CLOCK_S, abs=1e-6)
        shown = read_all.pictures[moment, 1].astype(float)
        error = np.square(shown - recording.colours("B", step, size=(80, 60))).mean()
        assert error < (1e-9 if "video" not in str(data_set) and not (data_set / "videos").exists() else 150)
        for robot in range(2):
            pelvis = recording.pelvis_in_world[step, robot]
            offset = recording.objects_in_world[step, :, :3] - pelvis[:3]
            assert np.allclose(read_all.objects_in_pelvis_m[moment, robot], offset @ rotation(pelvis[3:]), atol=1e-5)
    # After the end the last row is repeated and marked as padding. No chunk extends into another episode.
    assert read_all.told[8].tolist() == [True, False, False, False] and read_all.told[9].all()
    assert np.array_equal(read_all.chunks[8, 0], read_all.chunks[8, 3])
    assert np.array_equal(read_all.chunks[9, 1], read_all.chunks[10, 0])


def test_networks_are_shown_and_tell_what_scope_and_sharing_say() -> None:
    everyone, first, second = (0, 1), (0,), (1,)
    assert views("global", "shared", 2) == ((View(everyone, everyone),),)
    assert views("global", "separate", 2) == ((View(everyone, first),), (View(everyone, second),))
    assert views("local", "shared", 2) == ((View(first, first), View(second, second)),)
    assert views("local", "separate", 2) == ((View(first, first),), (View(second, second),))


@pytest.mark.parametrize("scope", get_args(Scope))
def test_the_program_takes_the_map(scope: Scope, tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text(map_text(replace(TINY, scope=scope), (160, 120), 10))
    command = [sys.executable, "-m", "tandem", "policy-map", "check", str(path)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def quiet(line: str) -> None:
    assert line


def trained(data_set: Path, out: Path, settings: TrainingSettings) -> dict[str, Any]:
    training: Any = import_module("tandem.baselines.training")
    folder = training.train(data_set, out, settings, threads=1, tell=quiet)
    return torch().load(folder / "policy.pt", weights_only=True)


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    weights = [[network["weights"] for network in policy["networks"]] for policy in (one, other)]
    pairs = [(first[name], second[name]) for first, second in zip(*weights, strict=True) for name in first]
    return all(torch().equal(first, second) for first, second in pairs)


def test_a_seed_gives_the_same_weights_stopped_in_between_or_not(
    data_set: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch()
    training: Any = import_module("tandem.baselines.training")
    for name, steps in (("REPORT_EVERY", 1), ("VALIDATE_EVERY", 2)):
        monkeypatch.setattr(training, name, steps)
    whole = trained(data_set, tmp_path / "whole", TINY)
    assert not same(whole, trained(data_set, tmp_path / "other", replace(TINY, seed=1)))

    def interrupt(line: str) -> None:
        if line.startswith("step 5 "):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        training.train(data_set, tmp_path / "parts", TINY, threads=1, tell=interrupt)
    assert not (tmp_path / "parts/policy.pt").exists()
    with pytest.raises(tandem.TandemError, match="other data or settings"):
        training.train(data_set, tmp_path / "parts", replace(TINY, seed=1), threads=1, tell=quiet)
    said: list[str] = []
    training.train(data_set, tmp_path / "parts", TINY, threads=1, tell=said.append)
    assert "going on after step 4" in said
    assert same(whole, trained(data_set, tmp_path / "parts", TINY))
    curve = (tmp_path / "parts/training.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in curve[1:]] == [str(step) for step in range(1, 7)]


@pytest.mark.parametrize("kind", get_args(PolicyKind))
@pytest.mark.parametrize("scope", get_args(Scope))
@pytest.mark.parametrize("sharing", get_args(Sharing))
def test_all_kinds_learn_and_answer(kind: PolicyKind, scope: Scope, sharing: Sharing, data_set: Path, tmp_path: Path) -> None:
    torch()
    settings = replace(TINY, kind=kind, scope=scope, sharing=sharing)
    policy = trained(data_set, tmp_path, settings)
    module: Any = import_module("tandem.baselines.policy")
    baseline = module.load(tmp_path)
    demonstrations = read(data_set, settings.chunk_rows, 1)
    for robots in [[0, 1]] if scope == "global" else [[0], [1]]:
        told: NDArray[np.float32] = baseline.act(demonstrations.pictures[3, robots], demonstrations.states[3, robots], robots)
        assert told.shape == (4, len(robots), 35)
        assert np.isfinite(told).all()
        # The joints in the demonstrations hardly move, so even a policy that has learned little predicts about the same.
        assert np.abs(told - demonstrations.chunks[3][:, robots]).mean() < 0.2
    assert len(policy["networks"]) == (1 if sharing == "shared" else 2)


def test_eyes_are_shown_the_same_in_training_as_in_play() -> None:
    torch()
    as_seen: Any = import_module("tandem.baselines.networks").as_seen
    generator = np.random.default_rng(1)
    pictures = generator.integers(0, 256, (3, 2, 6, 8, 3), dtype=np.uint8)
    gain = generator.uniform(0.7, 1.3, (3, 2, 1, 1, 3)).astype(np.float32)
    offset = generator.uniform(-0.1, 0.1, (3, 2, 1, 1, 1)).astype(np.float32)
    told, varied = (2 * values - 1 for values in (pictures / 255, np.minimum(1, np.maximum(0, pictures / 255 * gain + offset))))
    shown = as_seen(torch().from_numpy(pictures))
    assert shown.shape == (3, 2, 3, 6, 8)
    assert np.allclose(shown.permute(0, 1, 3, 4, 2), told, atol=1e-5)
    for kind, error in ((torch().float32, 1e-5), (torch().bfloat16, 3 / 255)):
        shown = as_seen(*(torch().from_numpy(values) for values in (pictures, gain, offset)), kind)
        assert shown.dtype == kind
        assert np.allclose(shown.float().permute(0, 1, 3, 4, 2), varied, atol=error)


def test_robots_that_are_told_to_hardly_walk_stand() -> None:
    torch()
    policy: Any = import_module("tandem.baselines.policy")
    walks = np.array([[0.0, -0.031, 0.0], [-0.02, 0.02, -0.051]], np.float32)
    stands = np.array([[0.02, -0.02, 0.04], [0.0, 0.0, 0.0]], np.float32)
    held = np.full((2, 31), 0.01, np.float32)
    height = np.full((2, 1), 0.75, np.float32)
    rows, told = (
        np.stack([np.concatenate([held, velocities, height], axis=1) for velocities in (walks, slow)])
        for slow in (stands, np.zeros_like(stands))
    )
    assert np.array_equal(policy.stood_still(rows), told)


@pytest.mark.parametrize("kind", get_args(PolicyKind))
def test_nothing_is_learned_from_rows_after_the_end(kind: PolicyKind) -> None:
    torch()
    networks: Any = import_module("tandem.baselines.networks")
    network = networks.PolicyNetwork(replace(TINY, kind=kind), 2, 2, 1)
    known, chunks = torch().ones(3, TINY.hidden), torch().ones(3, TINY.chunk_rows, 2, 35)
    told = torch().arange(TINY.chunk_rows) < torch().tensor([[1], [2], [2]])
    network.loss(known, chunks, told, torch().Generator().manual_seed(1)).backward()
    last = network.head.end if kind == "flow" else network.head
    learned = last.bias.grad.view(TINY.chunk_rows, -1) != 0
    assert learned[:2].all() and not learned[2:].any()


@pytest.mark.parametrize("kind", get_args(PolicyKind))
def test_losses_fall(kind: PolicyKind, data_set: Path) -> None:
    torch()
    learner_module: Any = import_module("tandem.baselines.learner")
    demonstrations: Demonstrations = read(data_set, 4, 1)
    settings = replace(TINY, kind=kind, steps=150, batch=8)
    learner = learner_module.Learner(demonstrations, views("global", "shared", 2)[0], settings, 0, "cpu")
    losses = np.array([learner.step(step) for step in range(settings.steps)])
    assert (losses[-20:].mean(axis=0) < 0.7 * losses[:20].mean(axis=0)).all()


def test_the_whole_way_from_demonstrations_to_a_report(tmp_path: Path) -> None:
    torch()
    tiny = ["--steps=4", "--batch=4", "--hidden=32", "--demonstrations=2000-2001", "--seeds=2003", "--jobs=2"]
    command = [sys.executable, "-m", "tandem.baselines", "recipe", "handover", "--out=out", *tiny]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    page = (tmp_path / "out/report.html").read_text()
    assert "chunk_global_shared_0" in page and "spread: 4" in page
    again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert again.returncode == 0 and "is trained already" in again.stdout


def test_what_cannot_be_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(tandem.TandemError, match="have: chunk, flow"):
        TrainingSettings(kind="spline")  # pyright: ignore[reportArgumentType]
    with pytest.raises(tandem.TandemError, match="of which 5 cannot be executed"):
        TrainingSettings(chunk_rows=4)
    with pytest.raises(tandem.TandemError, match="tandem export lerobot wrote"):
        read(tmp_path, 4, 1)
    assert main(["train", str(tmp_path), str(tmp_path / "out")]) == 1
    assert "tandem.baselines: " in capsys.readouterr().err
