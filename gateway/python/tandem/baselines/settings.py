"""Settings of a training run."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias, get_args

from ..errors import TandemError

PolicyKind: TypeAlias = Literal["chunk", "flow"]
Scope: TypeAlias = Literal["global", "local"]
Sharing: TypeAlias = Literal["shared", "separate"]


@dataclass(frozen=True)
class TrainingSettings:
    """All settings that determine a policy's weights, besides its data and the number of threads."""

    kind: PolicyKind = "chunk"
    """Kind of policy: "chunk" predicts one chunk of actions; "flow" samples one, by flow matching."""

    scope: Scope = "global"
    """Scope: with "global", the policy gets images and states of all robots; with "local", only those of the
    commanded robot.
    """

    sharing: Sharing = "shared"
    """Sharing of weights: "shared" is one set for all robots; "separate" is one set for each."""

    steps: int = 5000
    """Number of optimiser steps."""

    batch: int = 32
    """Batch size: number of moments per step."""

    chunk_rows: int = 10
    """Number of action rows in an answer, at the data set's rate."""

    execute_rows: int = 5
    """Number of these rows that are executed before the policy is queried again."""

    every: int = 2
    """One row in `every` of the data set is a training moment."""

    hidden: int = 512
    """Width of the layers between image encoders and actions."""

    keypoints: int = 32
    """Number of keypoints of an image encoder."""

    learning_rate: float = 1e-3
    """Maximum learning rate."""

    weight_decay: float = 1e-3
    """Weight decay of AdamW."""

    auxiliary: float = 0.3
    """Weight of the second task: predicting the objects' positions in the pelvis frame from an image. 0: none."""

    joint_noise_rad: float = 0.02
    """Standard deviation of noise on the joint angles in training."""

    clock_noise_s: float = 0.4
    """Standard deviation of noise on the time since the episode began."""

    averaging: float = 0.995
    """Factor of the exponential moving average of weights. Inference uses the averaged weights."""

    seed: int = 0
    """Seed of the weights, the order of the moments and the noise."""

    def __post_init__(self) -> None:
        for name, kind in (("kind", PolicyKind), ("scope", Scope), ("sharing", Sharing)):
            if (value := getattr(self, name)) not in get_args(kind):
                raise TandemError(f"no {name} {value!r}; have: {', '.join(get_args(kind))}")
        counts = ("steps", "batch", "chunk_rows", "execute_rows", "every", "hidden", "keypoints")
        if wrong := [name for name in counts if getattr(self, name) < 1]:
            raise TandemError(f"{wrong[0]} is {getattr(self, wrong[0])}; give 1 or more")
        if self.execute_rows > self.chunk_rows:
            raise TandemError(f"an answer has {self.chunk_rows} rows, of which {self.execute_rows} cannot be executed")

    def as_json(self) -> dict[str, Any]:
        """Returns the settings in the form for files."""
        return asdict(self)
