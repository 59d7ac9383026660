"""What a training run is told."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias, get_args

from ..errors import TandemError

PolicyKind: TypeAlias = Literal["chunk", "flow"]
Scope: TypeAlias = Literal["global", "local"]
Sharing: TypeAlias = Literal["shared", "separate"]


@dataclass(frozen=True)
class TrainingSettings:
    """Everything that a policy's weights come of, beside its data and the number of threads."""

    kind: PolicyKind = "chunk"
    """"chunk" tells one chunk of actions; "flow" draws one, by flow matching."""

    scope: Scope = "global"
    """"global": what all robots see and sense is shown to the policy; "local": only what the commanded robot does."""

    sharing: Sharing = "shared"
    """"shared": one set of weights for all robots; "separate": one for each."""

    steps: int = 5000
    """Steps of the optimiser."""

    batch: int = 32
    """Moments a step."""

    chunk_rows: int = 10
    """Rows of actions that an answer has, at the data set's rate."""

    execute_rows: int = 5
    """How many of these are executed before the policy is asked again."""

    every: int = 2
    """Each so manieth row of the data set is a moment that is learned from."""

    hidden: int = 512
    """Width of the layers between eyes and actions."""

    keypoints: int = 32
    """Points of a picture that an eye follows."""

    learning_rate: float = 1e-3
    """At its highest."""

    weight_decay: float = 1e-3
    """AdamW's."""

    auxiliary: float = 0.3
    """Weight of the second task: to tell from a picture where the objects are, before the robot's pelvis. 0: none."""

    joint_noise_rad: float = 0.02
    """Deviation of noise on the joint angles that are learned from."""

    clock_noise_s: float = 0.4
    """Deviation of noise on the time since the episode began."""

    averaging: float = 0.995
    """Of weights over steps (EMA), which are what plays."""

    seed: int = 0
    """Weights, order of the moments and noise come of it."""

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
        """As a file keeps it."""
        return asdict(self)
