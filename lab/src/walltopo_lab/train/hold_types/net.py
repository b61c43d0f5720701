"""The hold-type network: trained on reliefs, exported as ONNX."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from walltopo.core import Progress
from walltopo.describe.classify.types import SIDE
from walltopo_lab.train.small_nets import conv_block, export_net, train_net

WIDTHS = (16, 24, 32, 48)
NARROW, HIDDEN = 24, 48


@dataclass(frozen=True, eq=False)
class Samples:
    """Reliefs with their class labels.

    Parameters
    ----------
    pictures : (n, 2, SIDE, SIDE) float32; scalars : (n, 2) float32, see `Relief`.
    label : (n,) int64.
    """

    pictures: NDArray[np.float32]
    scalars: NDArray[np.float32]
    label: NDArray[np.int64]


class ReliefNet(nn.Module):
    """Network from (n, 2, SIDE, SIDE) reliefs and (n, 2) scalars to (n, classes) logits.

    The last layers keep positions in the frame: a scoop above differs from one below.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.body = nn.Sequential(
            conv_block(2, a, 2),
            conv_block(a, b),
            conv_block(b, c, 2),
            conv_block(c, c),
            conv_block(c, d, 2),
            nn.Conv2d(d, NARROW, 1),
            nn.ReLU(),
            nn.Flatten(),
        )
        flat = NARROW * (SIDE // 8) ** 2
        self.head = nn.Sequential(
            nn.Dropout(0.3),
            nn.Linear(flat + 2, HIDDEN),
            nn.ReLU(),
            nn.Dropout(0.2),
            nn.Linear(HIDDEN, classes),
        )

    def forward(self, reliefs: Tensor, scalars: Tensor) -> Tensor:
        return torch.as_tensor(self.head(torch.cat([self.body(reliefs), scalars], dim=1)))


class _Both(nn.Module):
    """Mean probabilities of several networks, over a relief and its mirror image."""

    def __init__(self, nets: Sequence[ReliefNet]) -> None:
        super().__init__()
        self.nets = nn.ModuleList(nets)

    def forward(self, reliefs: Tensor, scalars: Tensor) -> Tensor:
        looks = (reliefs, reliefs.flip(3))
        answers = [torch.softmax(net(look, scalars), 1) for net in self.nets for look in looks]
        return torch.stack(answers).mean(dim=0)


def _augment_reliefs(
    pictures: Tensor, scalars: Tensor, rng: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Return reliefs with random mirroring, shifts of up to 2 px and changes of size and height."""
    right, down = torch.randint(-2, 3, (2,), generator=rng).tolist()
    pictures = pictures.roll((down, right), (2, 3))
    mirror = torch.rand(len(pictures), generator=rng) < 0.5
    pictures = torch.where(mirror[:, None, None, None], pictures.flip(3), pictures)
    taller = torch.exp(0.05 * torch.randn(len(pictures), 1, 1, 1, generator=rng))
    pictures = torch.cat([pictures[:, :1] * taller, pictures[:, 1:]], dim=1)
    return pictures, scalars + 0.12 * torch.randn(len(scalars), 1, generator=rng)


def train(samples: Samples, classes: int, epochs: int, seed: int, progress: Progress) -> ReliefNet:
    """Return a trained network: see `train_net`."""
    pictures, label = torch.from_numpy(samples.pictures), torch.from_numpy(samples.label)
    scalars = torch.from_numpy(samples.scalars)
    loss_of = nn.CrossEntropyLoss(label_smoothing=0.05)

    def loss(net: ReliefNet, rows: Tensor, rng: torch.Generator) -> Tensor:
        answers = net(*_augment_reliefs(pictures[rows], scalars[rows], rng))
        return torch.as_tensor(loss_of(answers, label[rows]))

    return train_net(lambda: ReliefNet(classes), loss, len(label), epochs, seed, progress)


def write_onnx(nets: Sequence[ReliefNet], path: Path, facts: Mapping[str, Any]) -> None:
    """Write the networks as one ONNX file with metadata."""
    example = {"reliefs": torch.rand(3, 2, SIDE, SIDE), "scalars": torch.rand(3, 2)}
    export_net(_Both(nets), path, example, ("probabilities",), facts)
