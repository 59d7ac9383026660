"""openpi's own loader and transforms read the output of `tandem export lerobot --format v2`, with `gateway/examples/training`.

    pip install -r tests/peers/data_sets/openpi_data.txt        (Python 3.11)
    pip install --no-deps lerobot==0.3.3
    pip install "./gateway/python[lerobot]"
    PYTHONPATH=openpi/src:openpi/packages/openpi-client/src python tests/peers/data_sets/openpi_data.py

openpi is on no package registry: `openpi` is a checkout of its repository. LeRobot 0.3.3 has the version of the format that
openpi's own has, and is imported under the older name. Two demonstrations of Handover are exported for each robot. openpi's
data loader reads them by its configuration there; rows are compared with the recordings, and what the transforms of its policy
server make of an action with the action. The tokenizer, which openpi downloads, is replaced, and a model of its tests' size
computes a loss.
"""

import os
import sys
import tempfile
from pathlib import Path
from unittest import mock

import numpy as np

import tandem
from tandem.export import ExportSettings, export_lerobot

sys.path.append(str(Path(__file__).parents[3] / "gateway/examples/training"))
SCRATCH = tempfile.TemporaryDirectory()
os.environ["HF_LEROBOT_HOME"] = SCRATCH.name
os.environ["HF_HUB_OFFLINE"] = "1"

try:
    import jax
    import lerobot.datasets.lerobot_dataset

    sys.modules["lerobot.common"] = lerobot
    sys.modules["lerobot.common.datasets"] = lerobot.datasets
    sys.modules["lerobot.common.datasets.lerobot_dataset"] = lerobot.datasets.lerobot_dataset
    lerobot.common = lerobot
    import openpi_config
    from openpi.models import model as openpi_model
    from openpi.models import pi0_config
    from openpi.training import data_loader
    from openpi_client import image_tools
except ImportError as error:
    print(f"skipped: openpi_data: {error}; PYTHONPATH names no checkout of openpi", file=sys.stderr)
    sys.exit()

SEEDS = (2000, 2001)
ROW, STRIDE = 40, 5
MIN_DB = 28.0


def chosen(rows, base):
    """Arms, hands and base command of rows of joints in published order, or of actions."""
    arms_and_hands = [slice(15, 22), slice(29, 36), slice(22, 29), slice(36, 43)] if base == 43 else [slice(0, 28)]
    return np.concatenate([rows[..., part] for part in [*arms_and_hands, slice(base, base + 4)]], axis=-1)


def compare(dataset, data, episode, recording, robot, length_before):
    """Compares a row of the input of openpi's model, before normalisation, with the recording."""
    item = dataset[length_before + ROW]
    step = ROW * STRIDE
    state = chosen(recording.states[step, robot], 43)
    assert np.array_equal(item["state"], state), (episode, item["state"] - state)
    told = recording.actions[step + STRIDE, robot].copy()
    told[31:34] = recording.actions[step + 1 : step + STRIDE + 1, robot, 31:34].mean(axis=0)
    answer = {"state": np.asarray(item["state"]), "actions": np.array(item["actions"])}
    for transform in data.data_transforms.outputs:
        answer = transform({**answer, "state": np.asarray(item["state"])})
    error = np.abs(answer["actions"][0] - chosen(told, 31)).max()
    assert answer["actions"].shape == (50, 32) and error < 1e-6, (episode, answer["actions"].shape, error)
    seen = image_tools.resize_with_pad(recording.colours(recording.robots[robot], step, size=(320, 240)), 224, 224)
    difference = np.mean((item["image"]["base_0_rgb"].astype(float) - seen.astype(float)) ** 2)
    ratio_db = 10 * np.log10(255**2 / difference)
    assert ratio_db > MIN_DB, (episode, ratio_db)
    print(f"episode {episode}: state and 50 actions of 32 numbers, picture {ratio_db:.1f} dB")
    return item


def loss(items):
    """The loss of a small model on rows."""
    small = pi0_config.Pi0Config(pi05=True, paligemma_variant="dummy", action_expert_variant="dummy", max_token_len=256)
    batch = jax.tree.map(lambda *values: jax.numpy.stack([jax.numpy.asarray(value) for value in values]), *items)
    observation = openpi_model.Observation.from_dict(batch)
    values = small.create(jax.random.key(0)).compute_loss(jax.random.key(1), observation, batch["actions"])
    assert np.isfinite(values).all()
    print("loss of an untrained small model:", float(values.mean()))


def main():
    scratch = Path(SCRATCH.name)
    runs = scratch / "runs"
    seeds = f"{SEEDS[0]}-{SEEDS[-1]}"
    tandem.main(["collect", "--tasks", "handover", "--seeds", seeds, "--protocol", "benchmark", "--out", str(runs)])
    recordings = [tandem.Recording(runs / f"episodes/handover-{seed}") for seed in SEEDS]
    (train,) = openpi_config.get_tandem_configs()
    export_lerobot(runs, scratch / train.data.repo_id, ExportSettings(version="v2", view="robot"))
    told = []

    def tokenize(prompt, state):
        told.append(str(prompt))
        return np.zeros(256, np.int32), np.arange(256) < 100

    with mock.patch("openpi.models.tokenizer.PaligemmaTokenizer") as tokenizer:
        tokenizer.return_value.tokenize = tokenize
        data = train.data.create(scratch, train.model)
        rows = data_loader.create_torch_dataset(data, train.model.action_horizon, train.model)
        dataset = data_loader.transform_dataset(rows, data, skip_norm_stats=True)
        items, before = [], 0
        for episode in range(4):
            recording, robot = recordings[episode // 2], episode % 2
            items.append(compare(dataset, data, episode, recording, robot, before))
            assert told[-1] == recording.instructions[recording.robots[robot]], told
            before += len(range(0, len(recording) - 1, STRIDE))
        assert before == len(dataset)
        loss(items)


if __name__ == "__main__":
    main()
