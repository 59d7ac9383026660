"""LeRobot's own classes and trainer read the output of `tandem export lerobot`; so do `datasets` and PyArrow without LeRobot.

    pip install -r tests/peers/data_sets/lerobot_data.txt        (Python 3.12)
    pip install "./gateway/python[lerobot]"
    python tests/peers/data_sets/lerobot_data.py

Two demonstrations of Handover are recorded and exported with both codecs, as PNG, for each robot, with depth as films and as
files, and as version 2.1, which LeRobot's own converter takes over. Ten rows of each are drawn again from the recording and
compared with what LeRobot reads; its statistics of the same rows are compared with ours; the actions are played in a new
episode of the seed; `lerobot-edit-dataset` leaves out columns and merges; `lerobot-train` trains an ACT for twenty steps, and
`lerobot-eval` plays it in the environment with the same rows.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import datasets
import numpy as np
import torch
from lerobot.datasets.compute_stats import compute_episode_stats
from lerobot.datasets.lerobot_dataset import LeRobotDataset

import tandem
from tandem.export import ExportSettings, export_lerobot
from tandem.rows import read_contract

PROGRAMS = Path(sys.executable).parent
SEEDS = (2000, 2001)
SAMPLES = 10
ROW = 40
# What the codecs lose at their settings, small pictures more than large ones; PNG loses nothing.
MIN_DB = {"av1": 30.0, "h264": 28.0, "png": 90.0, "depth_png": 90.0}
# Half of a step at 10 m and of a millimetre, to which LeRobot rounds.
DEPTH_MM = 2.8
ACT = {
    "dim_model": 64,
    "n_heads": 2,
    "dim_feedforward": 128,
    "chunk_size": 10,
    "n_action_steps": 10,
    "pretrained_backbone_weights": "null",
    "device": "cpu",
    "push_to_hub": "false",
}


def noise_ratio_db(one, other):
    error = np.mean((one.astype(float) - other.astype(float)) ** 2)
    return 10 * np.log10(255**2 / max(error, 1e-9))


def opened(folder):
    return LeRobotDataset("local/handover", root=folder, video_backend="pyav")


def compare(name, folder, recordings, stride, robot=None):
    """Compares the rows that LeRobot reads with the recordings."""
    data_set = opened(folder)
    worst_db, worst_mm = np.inf, 0.0
    for row in np.linspace(0, len(data_set) - 1, SAMPLES).astype(int):
        item = data_set[int(row)]
        episode, frame = item["episode_index"].item(), item["frame_index"].item()
        a_recording = 1 if robot is None else 2
        recording, step = recordings[episode // a_recording], frame * stride
        own = slice(None) if robot is None else episode % a_recording
        assert np.array_equal(item["observation.state"].numpy(), np.ravel(recording.states[step, own])), (name, row)
        assert item["task"] == (recording.instruction if robot is None else recording.instructions[recording.robots[own]]), (
            item["task"]
        )
        for key in data_set.meta.camera_keys:
            camera = key.removeprefix("observation.images.").removesuffix("_depth")
            if camera == "egocentric":
                camera = recording.robots[own]
            height, width = item[key].shape[1:]
            if key in data_set.meta.depth_keys:
                seen_mm = np.clip(recording.picture(camera, step, size=(width, height)).depth_m, 0.01, 10.0) * 1000
                worst_mm = max(worst_mm, np.abs(item[key].numpy()[0] - seen_mm).max())
                continue
            shown = np.round(item[key].numpy().transpose(1, 2, 0) * 255).astype(np.uint8)
            worst_db = min(worst_db, noise_ratio_db(shown, recording.colours(camera, step, size=(width, height))))
    assert bool(data_set.meta.depth_keys) == name.startswith("depth"), data_set.meta.depth_keys
    assert worst_mm < DEPTH_MM, (name, worst_mm)
    depth = f", depth within {worst_mm:.1f} mm" * bool(data_set.meta.depth_keys)
    print(f"{name}: {data_set.num_episodes} episodes, {len(data_set)} rows, pictures at least {worst_db:.1f} dB{depth}")
    return data_set, worst_db


def compare_statistics(data_set):
    """Compares LeRobot's statistics of an episode's state with ours, whose quantiles are exact."""
    rows = data_set.hf_dataset.with_format("numpy")
    first = np.stack([rows[index]["observation.state"] for index in range(data_set.meta.episodes[0]["length"])])
    theirs = compute_episode_stats({"observation.state": first}, data_set.meta.features)["observation.state"]
    import pyarrow.parquet as parquet

    ours = parquet.read_table(data_set.root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()[0]
    for name, value in theirs.items():
        # Theirs come from histograms, and from sums of squares in single precision.
        tolerance = {"q": 0.02, "s": 5e-3}.get(name[0], 1e-4)
        error = np.abs(np.ravel(value) - np.ravel(ours[f"stats/observation.state/{name}"])).max()
        assert error <= tolerance, (name, error)
    print("statistics are as LeRobot's:", ", ".join(theirs))


def play(data_set, recordings, rate_hz):
    """Checks that the data set's actions, played like rows of a policy map, reach the recorded phases at the same times."""
    rows = data_set.hf_dataset.with_format("numpy")
    actions = np.stack([rows[index]["action"] for index in range(data_set.meta.episodes[0]["length"])])
    recording, steps = recordings[0], 50 // rate_hz
    parts = np.arange(1, steps + 1, dtype=np.float32) / steps
    with tandem.Episode("handover", recording.seed, protocol="benchmark") as episode:
        before = recording.actions[1]
        # It stands still for a second in the end, for phases that have to be held.
        for row in [*actions.reshape(len(actions), 2, 35), *[actions[-1].reshape(2, 35)] * rate_hz]:
            told = before[:, None] + (row - before)[:, None] * parts[:, None]
            told[..., 31:34] = row[:, None, 31:34]
            before = row
            if episode.step(told.astype(np.float32)).ended:
                break
        reached = episode.finish().phases
    # A phase may be reached one row later than in the recording.
    assert all(abs(reached[name] - time_s) < 1.5 / rate_hz for name, time_s in recording.result.phases.items()), reached
    print("actions played again reach", reached, "- recorded", recording.result.phases)


def train(folder, out):
    command = [
        PROGRAMS / "lerobot-train",
        "--dataset.repo_id=local/handover",
        f"--dataset.root={folder}",
        "--dataset.video_backend=pyav",
        "--policy.type=act",
        *(f"--policy.{name}={value}" for name, value in ACT.items()),
        "--batch_size=2",
        "--steps=20",
        "--num_workers=0",
        f"--output_dir={out}",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and "End of training" in done.stderr + done.stdout, done.stderr
    print("lerobot-train: twenty steps of ACT")
    return out / "checkpoints/last/pretrained_model"


def evaluate(folder, settings, policy, out):
    """Plays the policy in the environment with the rows of its data set. At another rate, it is refused."""
    command = [
        PROGRAMS / "lerobot-eval",
        "--env.discover_packages_path=lerobot_env_tandem",
        "--env.type=tandem",
        "--env.task=Handover-v0",
        f"--env.data_set={folder}",
        f"--env.observation_width={settings.size[0]}",
        f"--env.observation_height={settings.size[1]}",
        f"--policy.path={policy}",
        "--policy.device=cpu",
        "--eval.n_episodes=1",
        "--eval.batch_size=1",
        f"--output_dir={out}",
        "--seed=2002",
    ]
    refused = subprocess.run([*command, "--env.fps=10"], capture_output=True, text=True)
    assert refused.returncode != 0 and f"set fps={settings.rate_hz}" in refused.stderr, refused.stderr
    done = subprocess.run([*command, f"--env.fps={settings.rate_hz}"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    overall = json.loads((out / "eval_info.json").read_text())["overall"]
    assert overall["n_episodes"] == 1, overall
    print("lerobot-eval:", overall["pc_success"], "% of one episode")


def edited(operation, out, *more):
    command = [PROGRAMS / "lerobot-edit-dataset", f"--operation.type={operation}", f"--new_root={out}", *more]
    done = subprocess.run([*command, "--new_repo_id=local/edited"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


def edit(data_set, scratch):
    """LeRobot's own tools leave out columns and merge data sets. Such a data set has the contract of those it is made of."""
    folder = data_set.root
    names = [key for key in data_set.meta.features if key.startswith("privileged.")]
    given = ["--repo_id=local/handover", f"--root={folder}", f"--operation.feature_names={names}"]
    plain = edited("remove_feature", scratch / "plain", *given)
    merge = ["--operation.repo_ids=['local/a','local/b']", f"--operation.roots={[str(plain)] * 2}"]
    merged = opened(edited("merge", scratch / "merged", *merge))
    rows, length = merged.hf_dataset.with_format("numpy"), len(data_set)
    assert len(merged) == 2 * length and not set(names) & set(merged.meta.features), merged
    for key in ("observation.state", "action"):
        assert np.array_equal(rows[length + ROW][key], data_set.hf_dataset.with_format("numpy")[ROW][key]), key
    assert merged[length + ROW]["task"] == data_set[ROW]["task"]
    try:
        read_contract(merged.root)
    except tandem.TandemError as error:
        assert "give the original" in str(error), error
    features = read_contract(folder).features
    assert {key: tuple(merged.meta.features[key]["names"]) for key in features} == features
    print("lerobot-edit-dataset: merged", merged.num_episodes, "episodes without", len(names), "columns")


def converted(folder):
    """LeRobot's own converter makes version 3.0 of version 2.1."""
    module = "lerobot.scripts.convert_dataset_v21_to_v30"
    command = [sys.executable, "-m", module, "--repo-id=local/handover", f"--root={folder}", "--push-to-hub=false"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


def main():
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        runs = scratch / "runs"
        seeds = f"{SEEDS[0]}-{SEEDS[-1]}"
        tandem.main(["collect", "--tasks", "handover", "--seeds", seeds, "--protocol", "benchmark", "--out", str(runs)])
        recordings = [tandem.Recording(runs / f"episodes/handover-{seed}") for seed in SEEDS]
        cases = {
            "av1": (ExportSettings(cameras=("egocentric", "third_person"), codec="av1"), None),
            "h264": (ExportSettings(rate_hz=25, size=(160, 120)), None),
            "png": (ExportSettings(images="png", size=(160, 120)), None),
            "robot": (ExportSettings(view="robot"), True),
            "depth": (ExportSettings(cameras=("A", "third_person"), depth=True), None),
            "depth_png": (ExportSettings(view="robot", images="png", size=(160, 120), depth=True), True),
            "v2": (ExportSettings(version="v2", size=(160, 120)), None),
        }
        for name, (settings, robot) in cases.items():
            (exported,) = export_lerobot(runs, scratch / name, settings, only_successful=True)
            folder = converted(exported.folder) if name == "v2" else exported.folder
            data_set, worst_db = compare(name, folder, recordings, settings.stride, robot)
            assert worst_db > MIN_DB.get(name, MIN_DB["h264"]), (name, worst_db)
            if name == "av1":
                compare_statistics(data_set)
                play(data_set, recordings, settings.rate_hz)
                rows = datasets.load_dataset(str(folder), split="train")
                assert len(rows) == len(data_set) and len(rows[0]["action"]) == 70, rows
                print("datasets:", rows.column_names)
            if name == "h264":
                edit(data_set, scratch)
                evaluate(folder, settings, train(folder, scratch / "trained"), scratch / "evaluated")


if __name__ == "__main__":
    main()
