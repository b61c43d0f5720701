"""The network of the shipped detector: centres, boxes and masks of holds and volumes.

A small residual encoder (strides 2 to 32) with a top-down decoder, three outputs:

- heat, stride 4, per class: peaks at object centres (CenterNet: Zhou, Wang, Kraehenbuehl,
  "Objects as Points", 2019);
- votes, stride 4, per class: every pixel of an object predicts the distances to the four sides of
  the object's box (FCOS: Tian et al., ICCV 2019). The votes give the boxes and separate
  touching objects: a pixel belongs to the detection whose box it votes for;
- mask, stride 2, per class: whether a pixel is a hold, and whether it is a volume.

Plain 3x3 convolutions, which CPUs run near their peak, with batch normalisation, which
folds into the convolutions on export.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

CLASSES = ("hold", "volume")
_UNIT = 16.0  # px; the distance that a vote of 0 means


@dataclass(frozen=True)
class NetSize:
    """Channel counts and residual blocks per stage (strides 4, 8, 16, 32)."""

    stem: int = 16
    widths: tuple[int, int, int, int] = (32, 64, 128, 192)
    depths: tuple[int, int, int, int] = (2, 2, 2, 2)
    neck: int = 64

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


# Millions of weights: 0.8, 2.8, 6.4, 9.8, 17.3.
NET_SIZES = {
    "n": NetSize(stem=12, widths=(16, 32, 64, 96), neck=48),
    "s": NetSize(),
    "m": NetSize(stem=24, widths=(48, 96, 192, 288), neck=96),
    "l": NetSize(stem=24, widths=(48, 96, 192, 288), depths=(3, 4, 4, 3), neck=128),
    "x": NetSize(stem=32, widths=(64, 128, 256, 384), depths=(3, 4, 4, 3), neck=160),
}


def conv(inputs: int, outputs: int, size: int = 3, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class Block(nn.Module):
    """Residual block of two 3x3 convolutions."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = conv(width, width)
        self.second = nn.Conv2d(width, width, 3, padding=1, bias=False)
        self.norm = nn.BatchNorm2d(width)

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(x + self.norm(self.second(self.first(x))))


class Pool(nn.Module):
    """Context at the coarsest stride: parallel max pools of growing size (YOLO's SPPF)."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.reduce = conv(width, width // 2, 1)
        self.merge = conv(width * 2, width, 1)

    def forward(self, x: Tensor) -> Tensor:
        parts = [self.reduce(x)]
        for _ in range(3):
            parts.append(functional.max_pool2d(parts[-1], 5, 1, 2))
        return self.merge(torch.cat(parts, dim=1))


class VoteNet(nn.Module):
    """The network of the module docstring.

    The input is (n, 3, H, W) float RGB in 0..255, with sides that are multiples of 32.
    """

    def __init__(self, size: NetSize) -> None:
        super().__init__()
        self.size = size
        self.stem = conv(3, size.stem, 3, 2)
        before = (size.stem, *size.widths[:3])
        self.stages = nn.ModuleList(
            nn.Sequential(conv(a, b, 3, 2), *(Block(b) for _ in range(depth)))
            for a, b, depth in zip(before, size.widths, size.depths, strict=True)
        )
        self.pool = Pool(size.widths[3])
        w4, w8, w16, w32 = size.widths
        neck = (size.neck, max(w8, size.neck), w16)
        self.lateral = nn.ModuleList(
            nn.Conv2d(a, b, 1) for a, b in zip((w4, w8, w16), neck, strict=True)
        )
        self.descend = nn.ModuleList(
            nn.Conv2d(a, b, 1) for a, b in zip((neck[1], neck[2], w32), neck, strict=True)
        )
        self.smooth = nn.ModuleList(conv(width, width) for width in neck)
        self.head = conv(size.neck, size.neck)
        self.heat = nn.Conv2d(size.neck, len(CLASSES), 1)
        self.votes = nn.Conv2d(size.neck, 4 * len(CLASSES), 1)
        self.fine = nn.Conv2d(size.neck, size.stem, 1)
        self.blend = conv(2 * size.stem, size.stem)
        self.mask = nn.Conv2d(size.stem, len(CLASSES), 1)
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, nonlinearity="relu")
                if module.bias is not None:
                    nn.init.zeros_(module.bias)
        # Objects are rare: start with low probabilities, or the first steps only learn that.
        nn.init.normal_(self.heat.weight, std=0.01)
        nn.init.constant_(self.heat.bias, -4.0)
        nn.init.normal_(self.votes.weight, std=0.01)
        nn.init.constant_(self.mask.bias, -2.0)

    def forward(self, photo: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return heat and mask as logits, votes in pixels (left, top, right, bottom per class)."""
        stem = self.stem(photo / 64.0 - 2.0)
        x = stem
        levels = []
        for stage in self.stages:
            x = stage(x)
            levels.append(x)
        x = self.pool(levels[3])
        for k in (2, 1, 0):
            up = functional.interpolate(self.descend[k](x), scale_factor=2.0, mode="nearest")
            x = self.smooth[k](functional.relu(self.lateral[k](levels[k]) + up))
        head = self.head(x)
        votes = self.votes(head).float().clamp(-4.0, 4.0).exp() * _UNIT
        fine = functional.interpolate(
            self.fine(x), scale_factor=2.0, mode="bilinear", align_corners=False
        )
        mask = self.mask(self.blend(torch.cat([fine, stem], dim=1)))
        return self.heat(head).float(), votes, mask.float()


def build_net(size: NetSize | dict[str, Any] | None = None) -> VoteNet:
    """Return a network with random weights; `size` as saved in a checkpoint."""
    if isinstance(size, dict):
        size = NetSize(
            stem=size["stem"],
            widths=tuple(size["widths"]),
            depths=tuple(size["depths"]),
            neck=size["neck"],
        )
    return VoteNet(size or NetSize())
