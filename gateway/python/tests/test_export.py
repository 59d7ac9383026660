"""Data sets of recordings, read by independent libraries."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import tandem
from tandem.export import ExportSettings, export_lerobot
from tandem.export.command_line import main
from tandem.export.lerobot import find, splits

av: Any = pytest.importorskip("av")
parquet: Any = pytest.importorskip("pyarrow.parquet")

SIZE = (160, 120)
SETTINGS = ExportSettings(cameras=("egocentric", "third_person"), size=SIZE, codec="h264")
EYES = "observation.images.A"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two episodes that do not reach the last phase. The second is marked good."""
    folder = tmp_path_factory.mktemp("runs")
    for seed, steps in ((2010, 23), (2011, 40)):
        own = folder / f"handover-{seed}"
        own.mkdir()
        with tandem.Episode("handover", seed, protocol="benchmark", record=own) as episode:
            for part in (20, steps - 20):
                episode.walk(part, [tandem.WalkMove("A", 0.3, 0.0, 0.0)])
    (folder / "handover-2011" / "good").touch()
    return folder


def rows_of(data_set: Path) -> dict[str, Any]:
    table = parquet.read_table(data_set / "data/chunk-000/file-000.parquet")
    return {key: np.array(table[key].to_pylist()) for key in table.column_names if not key.startswith("observation.images")}


def film(data_set: Path, key: str, pixels: str = "rgb24") -> list[NDArray[Any]]:
    with av.open(str(data_set / f"videos/{key}/chunk-000/file-000.mp4")) as container:
        frames = list(container.decode(video=0))
    times = [float(frame.pts * frame.time_base) for frame in frames]
    assert times == pytest.approx([number / 10 for number in range(len(frames))])
    return [frame.to_ndarray(format=pixels) for frame in frames]


def noise_ratio_db(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    error = float(np.square(one.astype(float) - other.astype(float)).mean())
    return 10 * math.log10(255**2 / max(error, 1e-9))


@pytest.fixture(scope="module")
def whole(runs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    (exported,) = export_lerobot(runs, tmp_path_factory.mktemp("data") / "set", SETTINGS, jobs=2)
    assert (exported.task, exported.episodes, exported.rows) == ("handover", 2, 5 + 8)
    return exported.folder


def test_rows_are_what_the_recording_holds(runs: Path, whole: Path) -> None:
    rows = rows_of(whole)
    info = json.loads((whole / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["robot_type"]) == ("v3.0", 10, "unitree_g1_dex3")
    assert (info["total_episodes"], info["total_frames"], info["splits"]) == (2, 13, {"train": "0:2"})
    assert rows["observation.state"].shape == (13, 94)
    assert rows["action"].shape == (13, 70)
    for key, feature in info["features"].items():
        assert not key.startswith("observation.images") or feature["dtype"] == "video"
        if feature["names"] and key in rows:
            assert rows[key].shape == (13, len(feature["names"])), key
            assert len(set(feature["names"])) == len(feature["names"])
    assert rows["episode_index"].tolist() == [0] * 5 + [1] * 8
    assert rows["index"].tolist() == list(range(13))
    second = tandem.Recording(runs / "handover-2011")
    assert np.array_equal(rows["observation.state"][7], np.ravel(second.states[10]))
    # Joint targets are those of the step at which the next row begins; velocities are the mean until that step.
    names = info["features"]["action"]["names"]
    told = dict(zip(names, rows["action"][7], strict=True))
    joint = second.action_columns.index("waist_yaw_joint_rad")
    assert told["B.waist_yaw_joint_rad"] == second.actions[15, 1, joint]
    forward = second.action_columns.index("vx_m_s")
    assert told["A.vx_m_s"] == pytest.approx(second.actions[11:16, 0, forward].mean())
    objects: list[str] = info["features"]["privileged.objects_in_world"]["names"]
    place = dict(zip(objects, rows["privileged.objects_in_world"][7], strict=True))
    assert place["bottle.z_m"] == second.objects_in_world[10, second.objects.index("bottle"), 2]
    assert not rows["privileged.success"].any()
    assert not rows["privileged.phases_reached"].any()


def test_films_show_what_the_recording_saw(runs: Path, whole: Path) -> None:
    recording = tandem.Recording(runs / "handover-2011")
    for key, camera in ((EYES, "A"), ("observation.images.third_person", "third_person")):
        shown = film(whole, key)
        assert len(shown) == 13
        steps = (0, 20, 35)
        for row, step in ((5, 0), (9, 20), (12, 35)):
            ratios_db = [noise_ratio_db(shown[row], recording.colours(camera, other, size=SIZE)) for other in steps]
            assert max(ratios_db) == ratios_db[steps.index(step)] > 26, (camera, row, ratios_db)
    episodes = parquet.read_table(whole / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    spans = [(episode[f"videos/{EYES}/from_timestamp"], episode[f"videos/{EYES}/to_timestamp"]) for episode in episodes]
    assert spans == [(0.0, 0.5), (0.5, 1.3)]
    assert [episode["dataset_to_index"] for episode in episodes] == [5, 13]


def test_statistics_are_of_all_rows(whole: Path) -> None:
    rows, found = rows_of(whole), json.loads((whole / "meta/stats.json").read_text())
    state = found["observation.state"]
    assert state["count"] == [13]
    assert np.allclose(state["mean"], rows["observation.state"].mean(axis=0))
    assert np.allclose(state["q90"], np.quantile(rows["observation.state"].astype(float), 0.9, axis=0))
    seen = np.stack(film(whole, EYES)) / 255
    assert np.allclose(np.ravel(found[EYES]["mean"]), np.mean(seen, axis=(0, 1, 2)), atol=0.02)
    assert np.array(found[EYES]["q50"]).shape == (3, 1, 1)
    tasks = parquet.read_table(whole / "meta/tasks.parquet").to_pylist()
    assert [row["task_index"] for row in tasks] == [0]
    assert tasks[0]["task"].startswith("Robot A picks up the bottle")


def test_the_card_says_how_it_was_made(whole: Path, tmp_path: Path) -> None:
    card = (whole / "README.md").read_text()
    for line in (
        "* Robots were told: A: Take the bottle",
        "* Episodes: benchmark protocol, sensors ideal",
        "* Seeds: 2010-2011",
    ):
        assert f"\n{line}" in card, card
    varied = tmp_path / "varied"
    told = ["--tasks=handover", "--seeds=2012", "--protocol=benchmark", "--spread=2", "--variety=1", "--disturb=0.5"]
    command = [sys.executable, "-m", "tandem", "collect", *told, "--no-reports", f"--out={varied}"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    settings = ExportSettings(cameras=(), rate_hz=10, license="cc-by-4.0")
    (exported,) = export_lerobot(varied, tmp_path / "set", settings)
    licensed = (exported.folder / "README.md").read_text()
    assert "ideal, spread 2, variety 1, disturb 0.5\n" in licensed
    assert licensed.startswith("---\nlicense: cc-by-4.0\ntask_categories:") and card.startswith("---\ntask_categories:")
    with pytest.raises(tandem.TandemError, match=r"no licence 'CC BY'; .* for example cc-by-4\.0"):
        ExportSettings(license="CC BY")


def test_an_export_goes_on_and_disturbs_no_other(runs: Path, whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "set"

    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_lerobot(runs, out, SETTINGS, jobs=1, progress=interrupt)
    assert not out.exists()
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "set.partial").rglob("*.mp4")}
    assert kept
    with pytest.raises(tandem.TandemError, match="other recordings or settings"):
        export_lerobot(runs, out, ExportSettings(cameras=()))
    export_lerobot(runs, out, SETTINGS)
    assert not (tmp_path / "set.partial").exists()
    for path in ("data/chunk-000/file-000.parquet", f"videos/{EYES}/chunk-000/file-000.mp4", "meta/info.json"):
        assert (out / path).read_bytes() == (whole / path).read_bytes(), path
    export_lerobot(runs, out, SETTINGS)
    with pytest.raises(tandem.TandemError, match="give another folder"):
        export_lerobot(runs, out, ExportSettings(cameras=()))


def test_a_robot_has_episodes_of_its_own_and_pictures_in_the_table(runs: Path, tmp_path: Path) -> None:
    settings = ExportSettings(view="robot", images="png", size=(50, 35), rate_hz=25)
    (exported,) = export_lerobot(runs, tmp_path / "set", settings, only_good=True)
    assert (exported.episodes, exported.rows) == (2, 40)
    info = json.loads((exported.folder / "meta/info.json").read_text())
    assert info["splits"] == {"train": "0:2"}
    assert info["features"]["observation.images.egocentric"]["dtype"] == "image"
    rows = rows_of(exported.folder)
    recording = tandem.Recording(runs / "handover-2011")
    assert np.array_equal(rows["observation.state"][20], recording.states[0, 1])
    pictures = parquet.read_table(exported.folder / "data/chunk-000/file-000.parquet")["observation.images.egocentric"]
    with av.open(BytesIO(pictures[23].as_py()["bytes"])) as container:
        (frame,) = container.decode(video=0)
    assert np.array_equal(frame.to_ndarray(format="rgb24"), recording.colours("B", 6, size=(50, 35)))
    tasks = parquet.read_table(exported.folder / "meta/tasks.parquet").to_pylist()
    assert [row["task"] for row in tasks] == list(recording.instructions.values())


def test_setpoints_of_driven_motors_are_kept(tmp_path: Path) -> None:
    setpoints = np.zeros((5, 43), np.float32)
    setpoints[2], setpoints[3] = 100.0, 2.0
    with tandem.Episode("handover", 2012, protocol="benchmark", record=tmp_path / "run") as episode:
        episode.wait(10)
        angles = episode.get_robot_state("B").joint_positions_rad
        assert angles is not None
        setpoints[0] = list(angles.values())
        episode.send_joint_drives([tandem.JointDrives("B", np.tile(setpoints.ravel(), (5, 1)))])
        episode.walk(5, [tandem.WalkMove("B", 0.0, 0.0, 0.0)])
    recording = tandem.Recording(tmp_path / "run")
    assert list(recording.motor_setpoints) == ["B"]
    kept = recording.motor_setpoints["B"]
    assert kept.shape == (21, 5, 43) and np.isnan(kept[:11]).all() and np.isnan(kept[16:]).all()
    assert np.allclose(kept[11:16], setpoints, atol=1e-5)
    (exported,) = export_lerobot(tmp_path / "run", tmp_path / "set", SETTINGS, jobs=1)
    rows = rows_of(exported.folder)
    assert rows["motor_setpoints.B"].shape == (4, 215) and "motor_setpoints.A" not in rows
    assert np.allclose(rows["motor_setpoints.B"][2], setpoints.ravel(), atol=1e-5), "the step after this row"
    assert not rows["motor_setpoints.B"][[0, 1, 3]].any(), "its own controller drives it"
    info = json.loads((exported.folder / "meta/info.json").read_text())
    assert info["features"]["motor_setpoints.B"]["names"][86] == "left_hip_pitch_joint.kp_n_m_rad"


def test_depth_lies_beside_the_pictures_as_lerobot_stores_it(runs: Path, tmp_path: Path) -> None:
    size = (64, 48)
    (exported,) = export_lerobot(runs, tmp_path / "films", ExportSettings(size=size, depth=True))
    info = json.loads((exported.folder / "meta/info.json").read_text())
    feature = info["features"][f"{EYES}_depth"]
    assert (feature["dtype"], feature["shape"]) == ("video", [48, 64, 1])
    about = feature["info"]
    assert about["is_depth_map"] and not info["features"][EYES]["info"]["is_depth_map"]
    assert (about["video.codec"], about["video.pix_fmt"], about["video.channels"]) == ("hevc", "gray12le", 1)
    recording = tandem.Recording(runs / "handover-2011")
    nearest_m, farthest_m, shift_m = (about[f"video.{name}"] for name in ("depth_min", "depth_max", "shift"))
    assert about["video.use_log"]
    low, high = math.log(nearest_m + shift_m), math.log(farthest_m + shift_m)
    told = film(exported.folder, f"{EYES}_depth", "gray12le")
    for row, step in ((5, 0), (9, 20), (12, 35)):
        seen_m = recording.picture("A", step, size=size).depth_m
        told_m = np.exp(low + told[row] / 4095 * (high - low)) - shift_m
        assert np.abs(told_m - seen_m.clip(nearest_m, farthest_m)).max() < 0.0023
        assert 0.2 < np.median(told_m) < 5.0
    found = json.loads((exported.folder / "meta/stats.json").read_text())[f"{EYES}_depth"]
    told_mm = (np.exp(low + np.stack(told) / 4095 * (high - low)) - shift_m) * 1000
    assert np.ravel(found["mean"]) == pytest.approx([told_mm.mean()])
    assert np.ravel(found["max"]) == pytest.approx([told_mm.max()])
    assert np.array(found["q50"]).shape == (1, 1, 1)

    settings = ExportSettings(view="robot", images="png", size=size, depth=True)
    (exported,) = export_lerobot(runs, tmp_path / "files", settings, only_good=True)
    key = "observation.images.egocentric_depth"
    feature = json.loads((exported.folder / "meta/info.json").read_text())["features"][key]
    assert (feature["dtype"], feature["info"]) == ("image", {"is_depth_map": True, "depth_unit": "mm"})
    files = parquet.read_table(exported.folder / "data/chunk-000/file-000.parquet")[key]
    with av.open(BytesIO(files[8 + 2].as_py()["bytes"])) as container:
        (frame,) = container.decode(video=0)
    seen_mm = recording.picture("B", 10, size=size).depth_m.clip(0.01, 10.0) * 1000
    assert np.abs(frame.to_ndarray(format="gray16le") - seen_mm).max() <= 0.51


def test_version_2_has_files_for_each_episode(runs: Path, whole: Path, tmp_path: Path) -> None:
    settings = ExportSettings(version="v2", size=SIZE, codec="h264")
    (exported,) = export_lerobot(runs, tmp_path / "set", settings)
    info = json.loads((exported.folder / "meta/info.json").read_text())
    assert (info["codebase_version"], info["total_episodes"], info["total_videos"], info["total_chunks"]) == ("v2.1", 2, 4, 1)
    rows = rows_of(whole)
    for number, length in ((0, 5), (1, 8)):
        name = {"episode_chunk": 0, "episode_index": number, "video_key": EYES}
        table = parquet.read_table(exported.folder / info["data_path"].format(**name))
        assert table["index"].to_pylist() == list(range(number * 5, number * 5 + length))
        # Programs that read this version have a `datasets` before 4.0, which does not know "List".
        assert json.loads(table.schema.metadata[b"huggingface"])["info"]["features"]["action"]["_type"] == "Sequence"
        assert np.array_equal(np.array(table["action"].to_pylist()), rows["action"][rows["episode_index"] == number])
        with av.open(str(exported.folder / info["video_path"].format(**name))) as container:
            assert len(list(container.decode(video=0))) == length
    for name, lines in (("tasks", 1), ("episodes", 2), ("episodes_stats", 2)):
        assert len((exported.folder / f"meta/{name}.jsonl").read_text().splitlines()) == lines
    # Isaac-GR00T takes the columns of a part from each of the statistics; a count has one number.
    statistics = json.loads((exported.folder / "meta/stats.json").read_text())
    assert {len(found) for found in statistics["action"].values()} == {70}
    assert np.allclose(statistics["action"]["q99"], np.quantile(rows["action"].astype(float), 0.99, axis=0))


@pytest.mark.parametrize("view", ["joint", "robot"])
def test_parts_of_the_body_are_named_as_in_gr00t(view: Literal["joint", "robot"], runs: Path, tmp_path: Path) -> None:
    (exported,) = export_lerobot(runs, tmp_path / "set", ExportSettings(view=view, size=SIZE, depth=True))
    features = json.loads((exported.folder / "meta/info.json").read_text())["features"]
    parts = json.loads((exported.folder / "meta/modality.json").read_text())
    prefix, robot, eyes = ("B_", "B.", ["A_ego_view", "B_ego_view"]) if view == "joint" else ("", "", ["ego_view", "rs_view"])
    for kind, column in (("state", "observation.state"), ("action", "action")):
        names, ends = features[column]["names"], [span["end"] for span in parts[kind].values()]
        assert [0, *ends] == [*(span["start"] for span in parts[kind].values()), len(names)]
        for part, word, count in (("left_hand", "left_hand_", 7), ("waist", "waist_", 3), ("base_height_command", "pelvis", 1)):
            span = parts[kind][prefix + part]
            own = names[span["start"] : span["end"]]
            assert len(own) == count and all(name.startswith(robot + word) for name in own), (part, own)
    assert set(parts["action"]) < set(parts["state"])
    assert list(parts["video"]) == eyes
    assert {video["original_key"] for video in parts["video"].values()} < features.keys()
    assert parts["annotation"] == {"human.task_description": {"original_key": "task_index"}}


def test_images_are_drawn_by_the_chosen_renderer(runs: Path, tmp_path: Path) -> None:
    folder, size = runs / "handover-2010", (64, 48)
    embedded = tandem.Recording(folder, renderer="cpu").picture("A", 5, size=size)
    traced = tandem.Recording(folder, renderer="path").picture("A", 5, size=size)
    assert not np.array_equal(embedded.rgb, traced.rgb)
    assert traced.rgb.mean() == pytest.approx(embedded.rgb.mean(), rel=0.15)
    assert np.mean(np.isclose(embedded.depth_m, traced.depth_m, atol=1e-3)) > 0.99
    settings = ExportSettings(cameras=("A",), images="png", size=size, renderer="path")
    (exported,) = export_lerobot(folder, tmp_path / "set", settings)
    assert "renderer path" in (exported.folder / "README.md").read_text(encoding="utf-8")


def test_images_are_those_of_the_chosen_cameras(runs: Path, tmp_path: Path) -> None:
    folder = runs / "handover-2010"
    ideal, real = (tandem.Recording(folder, camera=camera).picture("A", 5) for camera in (None, "d435i"))
    assert np.isfinite(ideal.depth_m).all() and 0.5 < np.isfinite(real.depth_m).mean() < 1.0
    assert not np.array_equal(ideal.rgb, real.rgb)
    settings = ExportSettings(cameras=("A",), images="png", camera_model="d435i")
    (exported,) = export_lerobot(folder, tmp_path / "set", settings)
    assert "camera_model d435i" in (exported.folder / "README.md").read_text(encoding="utf-8")


def test_what_cannot_be_exported_is_said(runs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(tandem.TandemError, match="reached its last phase; all would"):
        export_lerobot(runs, tmp_path / "set", only_successful=True)
    with pytest.raises(tandem.TandemError, match="have: egocentric, third_person, A, B"):
        export_lerobot(runs, tmp_path / "set", ExportSettings(cameras=("C",)))
    with pytest.raises(tandem.TandemError, match="even number"):
        ExportSettings(size=(321, 240))
    with pytest.raises(tandem.TandemError, match="since version 3"):
        ExportSettings(version="v2", depth=True)
    with pytest.raises(tandem.TandemError, match="name cameras"):
        ExportSettings(cameras=(), depth=True)
    with pytest.raises(tandem.TandemError, match="have: auto, cpu, gpu, path"):
        ExportSettings(renderer="paint")  # pyright: ignore[reportArgumentType]
    with pytest.raises(tandem.TandemError, match="have: ideal, d435i"):
        ExportSettings(camera_model="fish")  # pyright: ignore[reportArgumentType]
    assert main(["lerobot", "--cameras=none", str(tmp_path / "nothing"), str(tmp_path / "set2")]) == 1
    assert "no episode.mcap in" in capsys.readouterr().err
    assert not (tmp_path / "set2").exists()


def test_order_and_splits(tmp_path: Path) -> None:
    for name in ("task-10", "task-9", "b-1"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "episode.mcap").touch()
    chosen = tmp_path / "chosen"
    chosen.mkdir()
    (chosen / "one").symlink_to(tmp_path / "task-9")
    (chosen / "other").symlink_to(tmp_path / "task-9")
    assert [path.parent.name for path in find(chosen)] == ["one"]
    # Links that lead back, or to exported files, add no files.
    (tmp_path / "latest").symlink_to(".")
    (chosen / "up").symlink_to(tmp_path)
    assert [path.parent.name for path in find(tmp_path)] == ["b-1", "task-9", "task-10"]
    assert splits(70, 2) == {"train": "0:100", "val": "100:120", "rest": "120:140"}
    assert splits(50, 1) == {"train": "0:50"}


def test_episodes_are_told_in_their_own_words(tmp_path: Path) -> None:
    words = {"handover": {"joint": "Reicht die Flasche weiter: 传递瓶子。", "robots": {"B": "Nimm sie."}}}
    (tmp_path / "words.json").write_text(json.dumps(words), encoding="utf-8")
    for seed, instructions in ((2010, None), (2011, tmp_path / "words.json")):
        tandem.evaluate(
            "idle", "handover", seed, out=tmp_path / f"out-{seed}", record=True, protocol="benchmark", instructions=instructions
        )
    recording = tandem.Recording(tmp_path / "out-2011/episodes/handover-2011")
    assert recording.instruction == words["handover"]["joint"] and recording.instructions["B"] == "Nimm sie."
    # Files are UTF-8 with any encoding of the locale.
    command = [sys.executable, "-m", "tandem.export", "lerobot", "--cameras=none", str(tmp_path), str(tmp_path / "set")]
    ascii_only = {**os.environ, "LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    subprocess.run(command, cwd=tmp_path, check=True, env=ascii_only)
    card = (tmp_path / "set/README.md").read_text(encoding="utf-8")
    own = tandem.Recording(tmp_path / "out-2010/episodes/handover-2010").instructions
    assert "B: Nimm sie." in card and own["B"] in card
    about = json.loads((tmp_path / "set/meta/tandem.json").read_text(encoding="utf-8"))
    assert about["instructions"] == [own, {**own, "B": "Nimm sie."}]
    tasks = parquet.read_table(tmp_path / "set/meta/tasks.parquet")
    assert str(words["handover"]["joint"]) in str(tasks.to_pylist())


def test_text_files_name_their_encoding() -> None:
    package = Path(tandem.__file__).parent
    calls = re.compile(r"(?:write_text|read_text|\b(?:fd)?open)\((?:[^()]|\([^()]*\)|\((?:[^()]|\([^()]*\))*\))*\)")
    binary = re.compile(r"\"[rwa]?b\"|\bos\.open|Image\.open|_av\.open|av\.open")
    for path in package.rglob("*.py"):
        source = path.read_text(encoding="utf-8")
        for call in calls.finditer(source):
            line = source[source.rfind("\n", 0, call.start()) + 1 : call.end()]
            assert "encoding" in line or binary.search(line), f"{path}: {line}"
