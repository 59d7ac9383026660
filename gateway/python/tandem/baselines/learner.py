# pyright: basic, reportMissingImports=false
# PyTorch is an extra that is not installed everywhere, and its types are partly unknown.
"""Training of one network: its samples, scales, steps and averaged weights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from .data import BASE, CLOCK_S, JOINTS, STATES, Demonstrations
from .networks import PolicyNetwork, as_seen, multiplies_halves
from .settings import TrainingSettings
from .views import View

WARM_UP = 100
"""Number of steps until the learning rate reaches its maximum."""

LARGEST_GRADIENT = 10.0

MIN_DEVIATIONS = {"states": 0.05, "chunks": 0.05, "objects": 0.02}
"""Lower limits of standard deviations, so that normalisation does not amplify nearly constant inputs."""

BASE_NOISE = (0.03, 0.03, 0.03, 0.01)
"""Standard deviations of the noise on the base command input, in the units of its columns."""


def scaled(values: Tensor, scale: Sequence[Tensor]) -> Tensor:
    mean, deviation = scale
    return (values - mean) / deviation


def unscaled(values: Tensor, scale: Sequence[Tensor]) -> Tensor:
    mean, deviation = scale
    return values * deviation + mean


class Learner:
    """A network with its training samples, one per moment and view."""

    def __init__(
        self, demonstrations: Demonstrations, views: tuple[View, ...], settings: TrainingSettings, number: int, device: str
    ) -> None:
        self.settings, self.views, self._device = settings, views, device
        self._seed = settings.seed + 7919 * number
        self._pictures = torch.from_numpy(demonstrations.pictures)
        moments = len(demonstrations)
        places_m = demonstrations.objects_in_pelvis_m.reshape(moments, len(demonstrations.robots), -1)
        self._values = {
            "states": torch.from_numpy(demonstrations.states),
            "chunks": torch.from_numpy(np.ascontiguousarray(demonstrations.chunks)),
            "objects": torch.from_numpy(places_m),
        }
        self._told = torch.from_numpy(demonstrations.told)
        self._learned = torch.from_numpy(np.flatnonzero(~demonstrations.validated))
        self._validated = torch.from_numpy(np.flatnonzero(demonstrations.validated))
        self._inputs = torch.tensor([view.inputs for view in views])
        self._outputs = torch.tensor([view.outputs for view in views])
        self.scales = {name: self._scale(name) for name in self._values}
        noise = [settings.joint_noise_rad] * JOINTS + list(BASE_NOISE) + [settings.clock_noise_s / CLOCK_S]
        self._noise = torch.tensor(noise)
        assert len(noise) == JOINTS + BASE + 1 == STATES
        torch.manual_seed(self._seed)
        objects = len(demonstrations.objects)
        self.network = PolicyNetwork(settings, len(views[0].inputs), len(views[0].outputs), objects).to(device)
        self.averaged = {name: value.clone() for name, value in self.network.state_dict().items()}
        self._optimizer = torch.optim.AdamW(self.network.parameters(), weight_decay=settings.weight_decay, fused=True)

    def step(self, step: int) -> tuple[float, float]:
        """Takes one step of the optimiser. Returns the losses of the actions and of the second task."""
        settings = self.settings
        # Each step has its own generator, so that a run from a checkpoint equals an uninterrupted one.
        generator = torch.Generator().manual_seed(self._seed * 1_000_003 + step)
        samples = len(self._learned) * len(self.views)
        chosen = torch.randint(samples, (settings.batch,), generator=generator)
        moments, views = self._learned[chosen // len(self.views)], chosen % len(self.views)
        for group in self._optimizer.param_groups:
            group["lr"] = settings.learning_rate * self._rate(step)
        self.network.train()
        actions, places = self._losses(moments, views, generator, noisy=True)
        self._optimizer.zero_grad(set_to_none=True)
        (actions + settings.auxiliary * places).backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), LARGEST_GRADIENT)
        self._optimizer.step()
        averaging = min(settings.averaging, (step + 1) / (step + 10))
        with torch.no_grad():
            for name, value in self.network.state_dict().items():
                if value.is_floating_point():
                    self.averaged[name].lerp_(value, 1 - averaging)
        return actions.item(), places.item()

    @torch.no_grad()
    def validate(self) -> tuple[float, float]:
        """Returns the mean errors of the averaged weights on the validation episodes: of actions in their own
        units, and of objects' coordinates in metres. NaN without validation episodes.
        """
        if not len(self._validated):
            return math.nan, math.nan
        own = {name: value.clone() for name, value in self.network.state_dict().items()}
        self.network.load_state_dict(self.averaged)
        self.network.eval()
        errors = torch.zeros(2)
        for view in range(len(self.views)):
            for moments in self._validated.split(64):
                views = torch.full_like(moments, view)
                known, places = self._look(moments, views, None)
                chunks = unscaled(self.network.act(known), self._scale_of("chunks"))
                of_rows = (chunks - self._of_outputs(moments, views)).abs().mean((2, 3)).cpu()
                told = self._told[moments]
                errors[0] += ((of_rows * told).sum(1) / told.sum(1)).sum()
                found = unscaled(places, self._scale_of("objects"))
                errors[1] += (found - self._of_inputs("objects", moments, views)).abs().mean((1, 2)).sum().cpu()
        self.network.load_state_dict(own)
        count = len(self._validated) * len(self.views)
        return errors[0].item() / count, errors[1].item() / count

    def checkpoint(self) -> dict[str, Any]:
        return {
            "network": self.network.state_dict(),
            "averaged": self.averaged,
            "optimizer": self._optimizer.state_dict(),
        }

    def restore(self, checkpoint: dict[str, Any]) -> None:
        self.network.load_state_dict(checkpoint["network"])
        self.averaged = checkpoint["averaged"]
        self._optimizer.load_state_dict(checkpoint["optimizer"])

    def trained(self) -> dict[str, Any]:
        """Returns the part of the state that inference needs."""
        return {
            "views": [[list(view.inputs), list(view.outputs)] for view in self.views],
            "weights": {name: value.cpu() for name, value in self.averaged.items()},
            "scales": self.scales,
        }

    def _losses(self, moments: Tensor, views: Tensor, generator: torch.Generator, noisy: bool) -> tuple[Tensor, Tensor]:
        known, places = self._look(moments, views, generator if noisy else None)
        chunks = scaled(self._of_outputs(moments, views), self._scale_of("chunks"))
        objects = scaled(self._of_inputs("objects", moments, views), self._scale_of("objects"))
        told = self._told[moments].to(self._device)
        return self.network.loss(known, chunks, told, generator), functional.l1_loss(places, objects)

    def _look(self, moments: Tensor, views: Tensor, generator: torch.Generator | None) -> tuple[Tensor, Tensor]:
        # Robots come first, so that the images of each are contiguous.
        pictures = self._pictures[moments, self._inputs[views].T].to(self._device)
        states = self._values["states"][moments[:, None], self._inputs[views]]
        if generator is None:
            seen = as_seen(pictures)
        else:
            # Colour, brightness and contrast vary. There are no shifts, because the network learns positions in the
            # image.
            each = (*pictures.shape[:2], 1, 1)
            colours = 1 + 0.2 * (torch.rand((*each, 3), generator=generator) - 0.5)
            gain = colours * (1 + 0.3 * (torch.rand((*each, 1), generator=generator) - 0.5))
            offset = 0.1 * (torch.rand((*each, 1), generator=generator) - 0.5)
            kind = torch.bfloat16 if multiplies_halves(pictures.device) else torch.float32
            seen = as_seen(pictures, gain, offset, kind)
            states = states + self._noise * torch.randn(states.shape, generator=generator)
        states = scaled(states, self.scales["states"])
        return self.network.look(seen.transpose(0, 1), states.to(self._device))

    def _of_inputs(self, name: str, moments: Tensor, views: Tensor) -> Tensor:
        return self._values[name][moments[:, None], self._inputs[views]].to(self._device)

    def _of_outputs(self, moments: Tensor, views: Tensor) -> Tensor:
        """Returns target chunks: batch by rows by outputs by 35."""
        return self._values["chunks"][moments[:, None], :, self._outputs[views]].transpose(1, 2).to(self._device)

    def _scale_of(self, name: str) -> list[Tensor]:
        return [part.to(self._device) for part in self.scales[name]]

    def _scale(self, name: str) -> tuple[Tensor, Tensor]:
        """Returns mean and standard deviation of the training data, over all views together: robots by columns."""
        robots = self._outputs if name == "chunks" else self._inputs
        values = self._values[name][self._learned]
        # Robots are the second last axis.
        seen = torch.cat([values[..., list(chosen), :] for chosen in robots.tolist()])
        axes = tuple(range(seen.dim() - 2))
        return seen.mean(axes), seen.std(axes).clamp(min=MIN_DEVIATIONS[name])

    def _rate(self, step: int) -> float:
        return min(1.0, (step + 1) / WARM_UP) * (0.5 * (1 + math.cos(math.pi * step / self.settings.steps)) + 0.01)
