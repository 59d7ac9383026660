r"""openpi's configuration of a data set of `tandem export lerobot RUNS handover --format v2 --view robot --rate 50`.

Copy this file to `src/openpi/training/misc/` of openpi. In `src/openpi/training/config.py`, import it as its
neighbours are imported, and add `*openpi_config.get_tandem_configs(),` to `_CONFIGS`. With the data set in
`$HF_LEROBOT_HOME/local/handover`:

    uv run scripts/compute_norm_stats.py --config-name pi05_tandem
    uv run scripts/train.py pi05_tandem --exp-name handover
    uv run scripts/serve_policy.py policy:checkpoint --policy.config=pi05_tandem \
        --policy.dir=checkpoints/pi05_tandem/handover/29999
    tandem evaluate --policy openpi:ws://127.0.0.1:8000 --protocol benchmark \
        --policy-map gateway/examples/training/openpi_map.toml

openpi's checkpoints have 32 numbers for state and action. Here, both are the 14 joints of the arms, the 14 of
the hands and the base command, in this order. The waist is held.
"""

import dataclasses

import einops
import numpy as np
import openpi.models.pi0_config as pi0_config
import openpi.training.weight_loaders as weight_loaders
import openpi.transforms as transforms

STATE = np.r_[15:22, 29:36, 22:29, 36:47]
ACTION = np.r_[0:28, 31:35]
JOINTS = 28
COLUMNS = len(ACTION)

REPACK = transforms.RepackTransform(
    {
        "observation/image": "observation.images.egocentric",
        "observation/state": "observation.state",
        "actions": "action",
        "prompt": "prompt",
    }
)
# Joints are learned as differences to the state at the beginning of a chunk.
DELTA = transforms.make_bool_mask(JOINTS, JOINTS - COLUMNS)


@dataclasses.dataclass(frozen=True)
class ChooseColumns(transforms.DataTransformFn):
    """Rows of the data set with the columns of the policy map."""

    def __call__(self, data: dict) -> dict:
        state, actions = (np.asarray(data[key]) for key in ("observation/state", "actions"))
        return {**data, "observation/state": state[..., STATE], "actions": actions[..., ACTION]}


@dataclasses.dataclass(frozen=True)
class TandemInputs(transforms.DataTransformFn):
    """Rows of the data set, or requests of the policy map, as pi0 and pi0.5 take them."""

    def __call__(self, data: dict) -> dict:
        image = np.asarray(data["observation/image"])
        if np.issubdtype(image.dtype, np.floating):
            # LeRobot's images are of floats, channels first.
            image = einops.rearrange((255 * image).round().astype(np.uint8), "c h w -> h w c")
        none = np.zeros_like(image)
        inputs = {
            "state": data["observation/state"],
            "image": {"base_0_rgb": image, "left_wrist_0_rgb": none, "right_wrist_0_rgb": none},
            "image_mask": {"base_0_rgb": np.True_, "left_wrist_0_rgb": np.False_, "right_wrist_0_rgb": np.False_},
        }
        return inputs | {key: data[key] for key in ("actions", "prompt") if key in data}


@dataclasses.dataclass(frozen=True)
class TandemOutputs(transforms.DataTransformFn):
    def __call__(self, data: dict) -> dict:
        return {"actions": np.asarray(data["actions"][..., :COLUMNS])}


def get_tandem_configs():
    # The module that imports this one.
    from openpi.training import config

    @dataclasses.dataclass(frozen=True)
    class TandemDataConfig(config.DataConfigFactory):
        def create(self, assets_dirs, model_config):
            data_transforms = transforms.Group(inputs=[TandemInputs()], outputs=[TandemOutputs()])
            return dataclasses.replace(
                self.create_base_config(assets_dirs, model_config),
                repack_transforms=transforms.Group(inputs=[REPACK, ChooseColumns()]),
                data_transforms=data_transforms.push(
                    inputs=[transforms.DeltaActions(DELTA)], outputs=[transforms.AbsoluteActions(DELTA)]
                ),
                model_transforms=config.ModelTransformFactory()(model_config),
                action_sequence_keys=("action",),
                prompt_from_task=True,
            )

    return [
        config.TrainConfig(
            name="pi05_tandem",
            # A state is 32 words of the prompt.
            model=pi0_config.Pi0Config(pi05=True, action_horizon=50, max_token_len=256),
            data=TandemDataConfig(repo_id="local/handover"),
            weight_loader=weight_loaders.CheckpointWeightLoader("gs://openpi-assets/checkpoints/pi05_base/params"),
        )
    ]
