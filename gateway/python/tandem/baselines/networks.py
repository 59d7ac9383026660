# pyright: basic, reportMissingImports=false
# PyTorch is an extra that is not installed everywhere, and its types are partly unknown.
"""Networks from images and states to chunks of actions."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from .data import ACTIONS, STATES
from .settings import TrainingSettings

FLOW_STEPS = 10
"""Number of Euler steps from noise to actions."""


@cache
def multiplies_halves(device: torch.device) -> bool:
    """Returns true if the device multiplies bfloat16 natively. Otherwise bfloat16 is slower than float32."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    told: dict[str, Any] = getattr(torch.cpu, "get_capabilities", dict)()
    return device.type == "cpu" and any(told.get(name) for name in ("avx512_bf16", "amx_bf16"))


def as_seen(
    pictures: Tensor, gain: Tensor | float = 1.0, offset: Tensor | float = 0.0, kind: torch.dtype = torch.float32
) -> Tensor:
    """Converts byte images, ... by height by width by 3, to the input of eyes: ... by 3 by height by width in
    -1..1.

    Args:
        gain, offset: Factors and offsets of an image's colours in 0..1, ... by 1 by 1 by 3.
        kind: Type of the result.
    """
    height, width, colours = pictures.shape[-3:]

    def of_rows(values: Tensor | float) -> Tensor:
        whole = torch.as_tensor(values, device=pictures.device).expand(*pictures.shape[:-3], 1, width, colours)
        return whole.reshape(*pictures.shape[:-3], 1, width * colours).to(kind)

    # Rows with all their colours fill the processor's vector registers.
    rows = pictures.reshape(*pictures.shape[:-3], height, width * colours).to(kind)
    seen = torch.addcmul(of_rows(2 * offset - 1), rows, of_rows(2 / 255 * gain)).clamp_(-1, 1)
    return seen.view(pictures.shape).movedim(-1, -3)


class Eye(nn.Module):
    """Image encoder from images, batch by 3 by height by width in -1..1, to features, batch by `width`.

    Keypoints by spatial softmax (Levine et al. 2016): the mean of the softmax of each of k maps, and a coarse view
    of all maps. A pixel of a small image covers 6 mm of a table. So only the first layer has a stride, and nothing
    is normalised over images.
    """

    def __init__(self, keypoints: int) -> None:
        super().__init__()
        self.convolutions = nn.Sequential(
            nn.Conv2d(3, 24, 8, stride=4, padding=2),
            nn.ReLU(inplace=True),
            nn.Conv2d(24, 32, 3, padding=1),
            nn.ReLU(inplace=True),
            nn.Conv2d(32, 32, 3, padding=2, dilation=2),
            nn.ReLU(inplace=True),
            nn.Conv2d(32, keypoints, 1),
        )
        for name, parameter in self.convolutions.named_parameters():
            if name.endswith("weight"):
                nn.init.kaiming_normal_(parameter, nonlinearity="relu")
            else:
                nn.init.zeros_(parameter)
        self.convolutions.to(memory_format=torch.channels_last)
        self.coarse = nn.Sequential(nn.AdaptiveAvgPool2d((3, 4)), nn.Flatten(), nn.Linear(keypoints * 12, 64), nn.ReLU())
        self.width = 2 * keypoints + 64

    def forward(self, pictures: Tensor) -> Tensor:
        with torch.autocast(pictures.device.type, torch.bfloat16, enabled=pictures.dtype == torch.bfloat16):
            maps = self.convolutions(pictures.contiguous(memory_format=torch.channels_last))
        # Positions in the image need the precision of float32.
        maps = maps.to(torch.float32, memory_format=torch.contiguous_format)
        height, width = maps.shape[-2:]
        weights = functional.softmax(maps.flatten(2), dim=-1)
        y, x = (torch.linspace(-1, 1, count, device=maps.device) for count in (height, width))
        places = weights @ torch.cartesian_prod(y, x)
        return torch.cat([places.flatten(1), self.coarse(maps)], dim=1)


class PolicyNetwork(nn.Module):
    """Network from images and states of `inputs` robots to chunks of actions of `outputs` robots. All values are
    normalised.
    """

    def __init__(self, settings: TrainingSettings, inputs: int, outputs: int, objects: int) -> None:
        super().__init__()
        self.chunk_shape = (settings.chunk_rows, outputs, ACTIONS)
        self.is_flow = settings.kind == "flow"
        hidden, target = settings.hidden, math.prod(self.chunk_shape)
        eyes = [Eye(settings.keypoints) for _ in range(inputs)]
        self.eyes, seen = nn.ModuleList(eyes), eyes[0].width
        self.objects = nn.ModuleList(
            nn.Sequential(nn.Linear(seen, 128), nn.ReLU(), nn.Linear(128, 3 * objects)) for _ in range(inputs)
        )
        self.state = nn.Sequential(nn.Linear(STATES * inputs, 128), nn.ReLU())
        known = inputs * (seen + 3 * objects) + 128
        self.trunk = nn.Sequential(nn.Linear(known, hidden), nn.ReLU(), nn.Linear(hidden, hidden), nn.ReLU())
        self.head = Flow(hidden, target) if self.is_flow else nn.Linear(hidden, target)

    def look(self, pictures: Tensor, states: Tensor) -> tuple[Tensor, Tensor]:
        """Encodes images (batch by inputs by 3 by height by width) and states (batch by inputs by `STATES`).
        Returns the head's input, batch by `hidden`, and the objects' positions, batch by inputs by 3 times objects.
        """
        seen = [eye(pictures[:, number]) for number, eye in enumerate(self.eyes)]
        places = [tell(features) for tell, features in zip(self.objects, seen, strict=True)]
        known = self.trunk(torch.cat([*seen, *places, self.state(states.flatten(1))], dim=1))
        return known, torch.stack(places, dim=1)

    def loss(self, known: Tensor, chunks: Tensor, told: Tensor, generator: torch.Generator) -> Tensor:
        """Returns the error against `chunks`, batch by rows by outputs by 35, in rows that were commanded, batch by
        rows.
        """
        target = chunks.flatten(1)
        if isinstance(self.head, Flow):
            # Flow matching (Lipman et al. 2023) on straight paths, x = (1 - t) noise + t chunk. The head predicts
            # the chunk, not the velocity chunk - noise, because all of the noise would have to pass through its
            # hidden layers.
            noise = torch.randn(target.shape, generator=generator).to(target.device)
            time = torch.rand(len(target), 1, generator=generator).to(target.device)
            errors = (self.head(known, (1 - time) * noise + time * target, time) - target).square()
        else:
            errors = (self.head(known) - target).abs()
        of_rows = errors.view(*told.shape, -1).mean(-1)
        return (of_rows * told).sum() / told.sum()

    def act(self, known: Tensor, noise: Tensor | None = None) -> Tensor:
        """Returns actions, batch by rows by outputs by 35. `noise`, batch by the product of these, is the start of
        a flow. None: zeros, the most likely start.
        """
        if not isinstance(self.head, Flow):
            return self.head(known).view(-1, *self.chunk_shape)
        chunk = known.new_zeros(len(known), math.prod(self.chunk_shape)) if noise is None else noise
        for step in range(FLOW_STEPS):
            time = known.new_full((len(known), 1), step / FLOW_STEPS)
            # The velocity is (predicted chunk - x) / (1 - t), of which a step takes 1 / FLOW_STEPS.
            chunk = chunk + (self.head(known, chunk, time) - chunk) / (FLOW_STEPS - step)
        return chunk.view(-1, *self.chunk_shape)


class Flow(nn.Module):
    """Network from a point on the path between noise and a chunk of actions, at a time in 0..1, to the chunk."""

    def __init__(self, hidden: int, target: int) -> None:
        super().__init__()
        self.frequencies: Tensor
        self.register_buffer("frequencies", math.pi * 2.0 ** torch.arange(4))
        self.begin = nn.Linear(hidden + target + 8, hidden)
        self.middle = nn.ModuleList(nn.Linear(hidden, hidden) for _ in range(2))
        self.end = nn.Linear(hidden, target)

    def forward(self, known: Tensor, chunk: Tensor, time: Tensor) -> Tensor:
        angles = time * self.frequencies
        flow = functional.silu(self.begin(torch.cat([known, chunk, angles.sin(), angles.cos()], dim=1)))
        for layer in self.middle:
            flow = flow + functional.silu(layer(flow))
        return self.end(flow)
