"""Data sets and environments have the same rows."""

from __future__ import annotations

import json
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import tandem
from tandem.export import ExportSettings, export_lerobot
from tandem.rows import ACTION, IMAGES, STATE, read_contract

gym = pytest.importorskip("gymnasium")
av: Any = pytest.importorskip("av")
parquet: Any = pytest.importorskip("pyarrow.parquet")

SEED = 2003
SIZE = (48, 36)
SIZED: dict[str, Any] = {"observation_width": SIZE[0], "observation_height": SIZE[1], "renderer": "cpu"}
STATE_TOLERANCE_RAD = {50: 0.0, 25: 0.05, 10: 0.05}
"""Maximum difference between a joint and its recorded angle. Between rows, experts do not move on straight lines."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of Handover's expert."""
    folder = tmp_path_factory.mktemp("rows") / "runs"
    asked = ["--tasks=handover", f"--seeds={SEED}", "--protocol=benchmark", "--no-reports", f"--out={folder}"]
    subprocess.run([sys.executable, "-m", "tandem", "collect", *asked], cwd=folder.parent, check=True)
    return folder


def exported(runs: Path, out: Path, **settings: Any) -> Path:
    (data_set,) = export_lerobot(runs, out, ExportSettings(images="png", size=SIZE, **settings), jobs=1)
    return data_set.folder


def made(**options: Any) -> Any:
    import gym_tandem

    return gym_tandem.TandemEnv("handover", **options)


def rows_of(data_set: Path) -> dict[str, NDArray[Any]]:
    table = parquet.read_table(data_set / "data/chunk-000/file-000.parquet")
    return {key: np.array(table[key].to_pylist()) for key in (STATE, ACTION, "episode_index")}


def picture(data_set: Path, name: str, row: int) -> NDArray[np.uint8]:
    column = parquet.read_table(data_set / "data/chunk-000/file-000.parquet")[IMAGES + name]
    with av.open(BytesIO(column[row].as_py()["bytes"])) as container:
        (frame,) = container.decode(video=0)
    return frame.to_ndarray(format="rgb24")


def named_features(data_set: Path) -> dict[str, list[str]]:
    features: dict[str, Any] = json.loads((data_set / "meta/info.json").read_text(encoding="utf-8"))["features"]
    return {key: feature["names"] for key, feature in features.items() if key == ACTION or key.startswith("observation.")}


@pytest.mark.parametrize("rate_hz", [50, 25, 10])
def test_actions_of_a_data_set_lead_the_environment_through_its_observations(runs: Path, tmp_path: Path, rate_hz: int) -> None:
    data_set = exported(runs, tmp_path / "set", rate_hz=rate_hz)
    recording = tandem.Recording(runs / f"episodes/handover-{SEED}")
    env = made(fps=rate_hz, data_set=data_set, **SIZED)
    assert env.metadata["render_fps"] == rate_hz
    assert named_features(data_set) == {key: list(names) for key, names in env.contract.features.items()}
    rows = rows_of(data_set)
    seen, info = env.reset(seed=SEED)
    assert env.observation_space.contains(seen)
    for robot in "AB":
        assert np.array_equal(seen["pixels"][robot], picture(data_set, robot, 0))
    farthest_rad = 0.0
    of_joints = [column.unit == "rad" for column in env.contract.state]
    last = len(rows[ACTION]) - 1
    row = 0
    # At the end the expert stands for up to a second, because the phase has to hold.
    for step in range(last + 1 + rate_hz):
        row = min(step, last)
        if step <= last:
            difference = np.abs(seen["agent_pos"] - rows[STATE][row])[of_joints]
            farthest_rad = max(farthest_rad, float(difference.max()))
        seen, _, terminated, truncated, info = env.step(rows[ACTION][row].astype(np.float32))
        assert not truncated
        if terminated:
            break
    assert info["is_success"], info
    assert farthest_rad <= STATE_TOLERANCE_RAD[rate_hz], farthest_rad
    if rate_hz == 50:
        assert env.state_hash() == recording.state_hashes[row + 1]
        assert np.array_equal(seen["agent_pos"], np.ravel(recording.states[row + 1]))
    env.close()


def test_an_agent_of_pettingzoo_has_the_rows_of_a_single_robot(runs: Path, tmp_path: Path) -> None:
    pytest.importorskip("pettingzoo")
    from gym_tandem.parallel import parallel_env

    data_set = exported(runs, tmp_path / "set", view="robot")
    env = parallel_env("handover", fps=10, data_set=data_set, **SIZED)
    assert named_features(data_set) == {key: list(names) for key, names in env.contract.features.items()}
    rows = rows_of(data_set)
    seen, _ = env.reset(seed=SEED)
    second = int(np.flatnonzero(rows["episode_index"] == 1)[0])
    for agent, row in (("A", 0), ("B", second)):
        assert env.observation_space(agent).contains(seen[agent])
        assert np.array_equal(seen[agent]["agent_pos"], rows[STATE][row])
        assert np.array_equal(seen[agent]["pixels"]["egocentric"], picture(data_set, "egocentric", row))
    env.close()


def test_a_data_set_that_does_not_fit_is_refused_with_what_differs(runs: Path, tmp_path: Path) -> None:
    data_set = exported(runs, tmp_path / "set", cameras=("egocentric", "third_person"))
    with pytest.raises(tandem.TandemError) as refused:
        made(data_set=data_set, action_type="wrists")
    for words in (
        "it has 10 rows per second, and the environment 50; set fps=10",
        "its image A has 48x36 pixels, and the environment's 320x240; set observation_width=48 and observation_height=36",
        "it has the image third_person, and the environment has A, B",
        "number 0 is A.left_shoulder_pitch_joint_rad in the data set and A.left_wrist_x_m in the environment",
    ):
        assert words in str(refused.value)
    fitting: dict[str, Any] = {"fps": 10, **SIZED}
    with pytest.raises(tandem.TandemError, match="94 numbers in the data set and 0 in the environment"):
        made(data_set=data_set, obs_type="pixels", **fitting)
    with pytest.raises(ValueError, match="no fps 30; have: 50, 25, 10"):
        made(fps=30)
    path = data_set / "meta/tandem.json"
    about = json.loads(path.read_text(encoding="utf-8"))
    about["contract"]["action"][0]["max"] = 9.0
    path.write_text(json.dumps(about), encoding="utf-8")
    with pytest.raises(tandem.TandemError, match=r"A\.left_shoulder_pitch_joint_rad is -.* to 9 rad in the data set"):
        made(data_set=data_set, **fitting)
    about["contract"]["version"] = 0
    path.write_text(json.dumps(about), encoding="utf-8")
    with pytest.raises(tandem.TandemError, match=r"has version 0 of the row contract, and this Tandem has 1; export"):
        read_contract(data_set)
    del about["contract"]
    path.write_text(json.dumps(about), encoding="utf-8")
    with pytest.raises(tandem.TandemError, match="names no row contract, because an older Tandem wrote it; export it again"):
        read_contract(data_set)


def test_names_of_rows_are_those_of_recordings_and_episodes(runs: Path) -> None:
    recording = tandem.Recording(runs / f"episodes/handover-{SEED}")
    env = made(obs_type="state")
    assert env.contract.images == {}
    for robot, columns in (("A", env.contract.action[:35]), ("B", env.contract.action[35:])):
        assert [column.name for column in columns] == [f"{robot}.{name}" for name in recording.action_columns]
    assert [column.name for column in env.contract.state[:43]] == [f"A.{joint}_rad" for joint in recording.joints]
    limits = np.array([(column.min, column.max) for column in env.contract.action], np.float32)
    assert np.array_equal(env.action_space.low, limits[:, 0]) and np.array_equal(env.action_space.high, limits[:, 1])
    assert {column.unit for column in env.contract.state} == {"rad", "m/s", "rad/s", "m"}
    env.close()


def test_lerobot_is_told_the_same_features(runs: Path, tmp_path: Path) -> None:
    pytest.importorskip("lerobot")
    from lerobot_env_tandem import TandemEnvConfig

    data_set = exported(runs, tmp_path / "set")
    config: Any = TandemEnvConfig("Handover-v0", data_set=str(data_set), observation_width=SIZE[0], observation_height=SIZE[1])
    features: dict[str, Any] = json.loads((data_set / "meta/info.json").read_text(encoding="utf-8"))["features"]
    told = {config.features_map[name]: list(feature.shape) for name, feature in config.features.items()}
    assert told == {key: features[key]["shape"] for key in named_features(data_set)}
    with pytest.raises(tandem.TandemError, match="set fps=10"):
        TandemEnvConfig("Handover-v0", fps=50, data_set=str(data_set))
