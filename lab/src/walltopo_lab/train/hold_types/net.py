"""The hold-type network: trained on reliefs, exported as ONNX."""

from __future__ import annotations

import json
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
from walltopo_lab.onnx_file import label_export, save_model

WIDTHS = (16, 24, 32, 48)
NARROW, HIDDEN = 24, 48
BATCH, RATE = 64, 3e-3


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


def _conv(inputs: int, outputs: int, stride: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
    )


class ReliefNet(nn.Module):
    """Network from (n, 2, SIDE, SIDE) reliefs and (n, 2) scalars to (n, classes) logits.

    The last layers keep positions in the frame: a scoop above differs from one below.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.body = nn.Sequential(
            _conv(2, a, 2),
            _conv(a, b, 1),
            _conv(b, c, 2),
            _conv(c, c, 1),
            _conv(c, d, 2),
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


def _varied(pictures: Tensor, scalars: Tensor, rng: torch.Generator) -> tuple[Tensor, Tensor]:
    """Return reliefs with random mirroring, shifts of up to 2 px and changes of size and height."""
    right, down = torch.randint(-2, 3, (2,), generator=rng).tolist()
    pictures = pictures.roll((down, right), (2, 3))
    mirror = torch.rand(len(pictures), generator=rng) < 0.5
    pictures = torch.where(mirror[:, None, None, None], pictures.flip(3), pictures)
    taller = torch.exp(0.05 * torch.randn(len(pictures), 1, 1, 1, generator=rng))
    pictures = torch.cat([pictures[:, :1] * taller, pictures[:, 1:]], dim=1)
    return pictures, scalars + 0.12 * torch.randn(len(scalars), 1, generator=rng)


def train(samples: Samples, classes: int, epochs: int, seed: int, progress: Progress) -> ReliefNet:
    """Return a network trained from random weights, in eval mode.

    Training uses one thread, so that the same seed gives the same network.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    rng = torch.Generator().manual_seed(seed)
    net = ReliefNet(classes)
    pictures, label = torch.from_numpy(samples.pictures), torch.from_numpy(samples.label)
    scalars = torch.from_numpy(samples.scalars)
    batches = len(label) // BATCH
    optimizer = torch.optim.AdamW(net.parameters(), RATE, weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, RATE, total_steps=epochs * batches, pct_start=0.15
    )
    loss_of = nn.CrossEntropyLoss(label_smoothing=0.05)
    for epoch in range(epochs):
        total = 0.0
        for rows in torch.randperm(len(label), generator=rng)[: batches * BATCH].split(BATCH):
            loss = loss_of(net(*_varied(pictures[rows], scalars[rows], rng)), label[rows])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += float(loss.detach())
        progress.note(f"seed {seed}, epoch {epoch + 1}: loss {total / batches:.3f}")
    return net.eval()


def write_onnx(nets: Sequence[ReliefNet], path: Path, facts: Mapping[str, Any]) -> None:
    """Write the networks as one ONNX file with metadata."""

    count = torch.export.Dim("holds", min=1, max=4096)
    program = torch.onnx.export(
        _Both(nets).eval(),
        (torch.rand(3, 2, SIDE, SIDE), torch.rand(3, 2)),
        dynamo=True,
        input_names=["reliefs", "scalars"],
        output_names=["probabilities"],
        dynamic_shapes={"reliefs": {0: count}, "scalars": {0: count}},
        verbose=False,
    )
    model = program.model_proto
    label_export(model, {key: json.dumps(value) for key, value in facts.items()})
    save_model(model, path)
