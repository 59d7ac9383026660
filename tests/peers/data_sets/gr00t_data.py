"""Isaac-GR00T's own classes read the unchanged output of `tandem export lerobot --format v2`.

    pip install -r tests/peers/data_sets/gr00t_data.txt        (Python 3.12)
    pip install "./gateway/python[lerobot]"
    PYTHONPATH=Isaac-GR00T python tests/peers/data_sets/gr00t_data.py

GR00T is on no package registry: `Isaac-GR00T` is a checkout of its repository, of N1.5, N1.6 or N1.7; N1.5 also needs
PyTorch3D. Two demonstrations of Handover are exported for each robot. GR00T's configuration of a Unitree G1 loads them without
any change; a row's parts, image and instruction, and the statistics, are compared with the recordings. Then it loads the rows
of both robots together, whose parts have the robots' names.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import tandem
from tandem.export import ExportSettings, export_lerobot

try:
    from gr00t.data import dataset as gr00t_data
    from gr00t.data.embodiment_tags import EmbodimentTag
except ImportError as error:
    print(f"skipped: gr00t_data: {error}; PYTHONPATH names no checkout of Isaac-GR00T", file=sys.stderr)
    sys.exit()

SEEDS = (2000, 2001)
ROW = 40
MIN_DB = 28.0
# Columns of a robot's state and action.
STATE = {
    "left_leg": (0, 6),
    "right_leg": (6, 12),
    "waist": (12, 15),
    "left_arm": (15, 22),
    "left_hand": (22, 29),
    "right_arm": (29, 36),
    "right_hand": (36, 43),
}
ACTION = {
    "left_arm": (0, 7),
    "right_arm": (7, 14),
    "left_hand": (14, 21),
    "right_hand": (21, 28),
    "waist": (28, 31),
    "navigate_command": (31, 34),
    "base_height_command": (34, 35),
}
INSTRUCTION = "annotation.human.task_description"
N15 = hasattr(gr00t_data, "LeRobotSingleDataset")


def configuration():
    """Keys and horizons of GR00T's own configuration of the robot."""
    if N15:
        # Those of `unitree_g1_full_body`, whose module imports the model.
        keys = {"video": ["rs_view"], "state": list(STATE), "action": ["left_arm", "right_arm", "left_hand", "right_hand"]}
        return keys, {"video": [0], "state": [0], "action": list(range(16))}
    from gr00t.configs.data.embodiment_configs import MODALITY_CONFIGS

    own = MODALITY_CONFIGS[EmbodimentTag.UNITREE_G1.value]
    assert own["language"].modality_keys == [INSTRUCTION]
    kinds = ("video", "state", "action")
    return {kind: own[kind].modality_keys for kind in kinds}, {kind: own[kind].delta_indices for kind in kinds}


def read_n15(folder, keys, horizons, episode):
    def config(keys, horizon):
        return gr00t_data.ModalityConfig(delta_indices=horizon, modality_keys=keys)

    configs = {kind: config([f"{kind}.{key}" for key in keys[kind]], horizons[kind]) for kind in keys}
    configs["language"] = config([INSTRUCTION], [0])
    data = gr00t_data.LeRobotSingleDataset(folder, configs, EmbodimentTag.NEW_EMBODIMENT)
    row = data.get_step_data(episode, ROW)
    return {key: value[0] for key, value in row.items()}, data.metadata.statistics.model_dump()


def read_newer(folder, keys, horizons, episode):
    from gr00t.data.dataset.lerobot_episode_loader import LeRobotEpisodeLoader
    from gr00t.data.types import ModalityConfig

    configs = {kind: ModalityConfig(delta_indices=horizons[kind], modality_keys=keys[kind]) for kind in keys}
    configs["language"] = ModalityConfig(delta_indices=[0], modality_keys=[INSTRUCTION])
    data = LeRobotEpisodeLoader(folder, configs, video_backend="decord")
    row = data[episode].loc[ROW]
    return {key.removeprefix("language."): row[key] for key in row.index}, data.get_dataset_statistics()


def compare(name, folder, episode, keys, horizons, recording, robots, instruction):
    """Compares a row that GR00T reads, and its statistics, with the recordings.

    robots: index of the robot in the recording, by the beginning of its parts' names.
    """
    row, statistics = (read_n15 if N15 else read_newer)(folder, keys, horizons, episode)
    step, stride = ROW * 5, 5
    told = recording.actions[step + stride]
    told[:, 31:34] = recording.actions[step + 1 : step + stride + 1, :, 31:34].mean(axis=0)
    for kind, values, parts in (("state", recording.states[step], STATE), ("action", told, ACTION)):
        for prefix, robot in robots.items():
            for part in (key.removeprefix(prefix) for key in keys[kind] if key.startswith(prefix)):
                begin, end = parts[part]
                assert np.array_equal(row[f"{kind}.{prefix}{part}"], values[robot, begin:end]), (name, kind, part)
                assert np.shape(statistics[kind][prefix + part]["q99"]) == (end - begin,), (name, kind, part)
    worst_db = np.inf
    for camera in keys["video"]:
        shown = row[f"video.{camera}"]
        robot = next(robot for prefix, robot in robots.items() if camera.startswith(prefix))
        seen = recording.colours(recording.robots[robot], step, size=(shown.shape[1], shown.shape[0]))
        error = np.mean((shown.astype(float) - seen.astype(float)) ** 2)
        worst_db = min(worst_db, 10 * np.log10(255**2 / error))
    assert worst_db > MIN_DB, (name, worst_db)
    assert row[INSTRUCTION] == instruction, (name, row[INSTRUCTION])
    print(f"{name}: {len(row)} parts of a row, pictures at least {worst_db:.1f} dB, {instruction[:40]!r}")


def main():
    keys, horizons = configuration()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = Path(scratch)
        runs = scratch / "runs"
        seeds = f"{SEEDS[0]}-{SEEDS[-1]}"
        tandem.main(["collect", "--tasks", "handover", "--seeds", seeds, "--protocol", "benchmark", "--out", str(runs)])
        recordings = [tandem.Recording(runs / f"episodes/handover-{seed}") for seed in SEEDS]
        (alone,) = export_lerobot(runs, scratch / "robot", ExportSettings(version="v2", view="robot"))
        statistics = (alone.folder / "meta/stats.json").read_bytes()
        for episode in range(alone.episodes):
            recording, robot = recordings[episode // 2], episode % 2
            instruction = recording.instructions[recording.robots[robot]]
            compare(f"robot {episode}", alone.folder, episode, keys, horizons, recording, {"": robot}, instruction)
        assert (alone.folder / "meta/stats.json").read_bytes() == statistics, "GR00T has made statistics of its own"
        (team,) = export_lerobot(runs, scratch / "joint", ExportSettings(version="v2"))
        robots = {"A_": 0, "B_": 1}
        team_keys = {kind: [prefix + key for prefix in robots for key in keys[kind]] for kind in ("state", "action")}
        team_keys["video"] = ["A_ego_view", "B_ego_view"]
        compare("joint", team.folder, 1, team_keys, horizons, recordings[1], robots, recordings[1].instruction)


if __name__ == "__main__":
    main()
