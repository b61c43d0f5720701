"""The network of two-coloured holds: trained on views of generated holds, exported as ONNX."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from walltopo.core import Progress
from walltopo.describe.classify.two_colours import CHANNELS, SIDE
from walltopo_lab.train.small_nets import BATCH, conv_block, export_net, train_net
from walltopo_lab.train.two_colours.views import NONE, SOME, PartedViews

WIDTHS = (12, 32, 48)


class PartNet(nn.Module):
    """Network from (n, CHANNELS, SIDE, SIDE) views to log odds (n,) of two colours, and to log odds
    (n, SIDE, SIDE) of one of both parts."""

    def __init__(self) -> None:
        super().__init__()
        a, b, c = WIDTHS
        self.fine = conv_block(CHANNELS, a)
        self.middle = nn.Sequential(conv_block(a, b, 2), conv_block(b, b))
        self.coarse = nn.Sequential(conv_block(b, c, 2), conv_block(c, c), conv_block(c, c))
        self.head = nn.Sequential(nn.Dropout(0.2), nn.Linear(3 * c, c), nn.ReLU(), nn.Linear(c, 1))
        self.up = conv_block(b + c, b)
        self.out = nn.Sequential(conv_block(a + b, a), nn.Conv2d(a, 1, 1))

    def forward(self, views: Tensor) -> tuple[Tensor, Tensor]:
        fine = self.fine(views)
        middle = self.middle(fine)
        coarse = self.coarse(middle)
        cover = functional.adaptive_avg_pool2d(views[:, 3:4], SIDE // 4)
        mean = (coarse * cover).sum((2, 3)) / (cover.sum((2, 3)) + 1e-3)
        spread = ((coarse - mean[..., None, None]) ** 2 * cover).sum((2, 3))
        spread = (spread / (cover.sum((2, 3)) + 1e-3) + 1e-6).sqrt()
        pooled = torch.cat([mean, spread, (coarse * cover).amax((2, 3))], dim=1)
        wide = functional.interpolate(coarse, scale_factor=2.0, mode="nearest")
        wide = self.up(torch.cat([middle, wide], dim=1))
        wide = functional.interpolate(wide, scale_factor=2.0, mode="nearest")
        part = self.out(torch.cat([fine, wide], dim=1))
        return self.head(pooled)[:, 0], part[:, 0]


class _Several(nn.Module):
    """Mean log odds of several networks, over a view and its mirror image; the first's parts."""

    def __init__(self, nets: Sequence[PartNet]) -> None:
        super().__init__()
        self.nets = nn.ModuleList(nets)

    def forward(self, views: Tensor) -> tuple[Tensor, Tensor]:
        odds = [net(look)[0] for net in self.nets for look in (views, views.flip(3))]
        return torch.stack(odds).mean(dim=0), torch.sigmoid(self.nets[0](views)[1])


def varied(pictures: Tensor, parts: Tensor, rng: torch.Generator) -> tuple[Tensor, Tensor]:
    """Return views with random mirroring, quarter turns, and changes of hue and light.

    All hues are turned by one angle, so that the network learns differences of paint and no
    palette.
    """
    turns = int(torch.randint(0, 4, (1,), generator=rng))
    both = torch.cat([pictures, parts[:, None]], dim=1).rot90(turns, (2, 3))
    if torch.rand(1, generator=rng) < 0.5:
        both = both.flip(3)
    pictures, parts = both[:, :-1], both[:, -1]
    count = len(pictures)
    angle = torch.rand(count, generator=rng) * 2 * np.pi
    mirror = torch.where(torch.rand(count, generator=rng) < 0.5, -1.0, 1.0)
    chroma = torch.exp(0.15 * torch.randn(count, generator=rng))
    cosine, sine = torch.cos(angle) * chroma, torch.sin(angle) * chroma
    a, b = pictures[:, 0], pictures[:, 1] * mirror[:, None, None]
    turned = torch.stack(
        [
            cosine[:, None, None] * a - sine[:, None, None] * b,
            sine[:, None, None] * a + cosine[:, None, None] * b,
        ],
        dim=1,
    )
    light = torch.exp(0.12 * torch.randn(count, 1, 1, 1, generator=rng))
    return torch.cat([turned, pictures[:, 2:3] * light, pictures[:, 3:]], dim=1), parts


def loss_of(odds: Tensor, part: Tensor, views: Tensor, truth: Tensor, share: Tensor) -> Tensor:
    """Return the mean loss of a batch: of the log odds, and of the parts of two-coloured views.

    Either part may be called the first: the better of both ways counts. Views of which a few
    pixels have another colour count in neither.
    """
    smaller = torch.minimum(share, 1 - share)
    two = (smaller >= SOME).float()
    known = ((smaller < NONE) | (smaller >= SOME)).float()
    answer = functional.binary_cross_entropy_with_logits(odds, two, reduction="none")
    cover = views[:, 3]
    ways = [
        (functional.binary_cross_entropy_with_logits(part, wanted, reduction="none") * cover).sum(
            (1, 2)
        )
        / cover.sum((1, 2)).clamp(min=1.0)
        for wanted in (truth, 1 - truth)
    ]
    outline = torch.minimum(*ways) * two
    return (answer * known).mean() + 0.5 * outline.sum() / two.sum().clamp(min=1.0)


def train(views: PartedViews, epochs: int, seed: int, progress: Progress) -> PartNet:
    """Return a trained network: see `train_net`."""
    pictures, parts = torch.from_numpy(views.pictures), torch.from_numpy(views.parts)
    share = torch.from_numpy(views.share.astype(np.float32))

    def loss(net: PartNet, rows: Tensor, rng: torch.Generator) -> Tensor:
        own, truth = varied(pictures[rows], parts[rows], rng)
        odds, part = net(own)
        return loss_of(odds, part, own, truth, share[rows])

    return train_net(PartNet, loss, len(share), epochs, seed, progress)


def answers(nets: Sequence[PartNet], pictures: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (n,) log odds of two colours, as the exported file answers."""
    both = _Several(nets).eval()
    with torch.no_grad():
        rows = [both(block)[0] for block in torch.from_numpy(pictures).split(BATCH)]
    return np.asarray(torch.cat(rows).numpy())


def write_onnx(nets: Sequence[PartNet], path: Path, facts: Mapping[str, Any]) -> None:
    """Write the networks as one ONNX file with metadata."""
    example = {"views": torch.rand(3, CHANNELS, SIDE, SIDE)}
    export_net(_Several(nets), path, example, ("odds", "parts"), facts)
