"""The network of the shipped detector: centres, boxes and masks of holds and volumes.

An EfficientNet-Lite encoder (`walltopo_lab.train.encoder`, strides 2 to 32) with a top-down
decoder, three outputs:

- heat, stride 4, per class: peaks at object centres (CenterNet: Zhou, Wang, Kraehenbuehl,
  "Objects as Points", 2019);
- votes, stride 4, per class: every pixel of an object predicts the distances to the four sides of
  the object's box (FCOS: Tian et al., ICCV 2019). The votes give the boxes and separate
  touching objects: a pixel belongs to the detection whose box it votes for;
- mask, stride 2, per class: whether a pixel is a hold, and whether it is a volume.

Every convolution is followed by batch normalisation, which folds into it on export.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from walltopo.core import InputError
from walltopo_lab.train.encoder import LiteEncoder, imagenet_file, load_imagenet

CLASSES = ("hold", "volume")
_UNIT = 16.0  # px; the distance that a vote of 0 means


@dataclass(frozen=True)
class NetSize:
    """The size of a network.

    Parameters
    ----------
    width, depth : multipliers of the encoder, see `LiteEncoder`.
    neck : channels of the decoder at strides 4, 8 and 16.
    deep : channels at stride 32.
    fine : channels at stride 2.
    """

    width: float = 1.1
    depth: float = 1.2
    neck: tuple[int, int, int] = (64, 96, 128)
    deep: int = 192
    fine: int = 24

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


# Millions of weights: 4.5, 4.6, 4.9.
NET_SIZES = {
    "lite0": NetSize(1.0, 1.0),
    "lite1": NetSize(1.0, 1.1),
    "lite2": NetSize(),
}


def conv(inputs: int, outputs: int, size: int = 3, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class Pool(nn.Module):
    """Context at the coarsest stride: parallel max pools of growing size (YOLO's SPPF)."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.reduce = conv(inputs, outputs // 2, 1)
        self.merge = conv(outputs * 2, outputs, 1)

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
        self.encoder = LiteEncoder(size.width, size.depth)
        w2, w4, w8, w16, w32 = self.encoder.channels
        neck = size.neck
        self.pool = Pool(w32, size.deep)
        self.lateral = nn.ModuleList(
            nn.Conv2d(a, b, 1) for a, b in zip((w4, w8, w16), neck, strict=True)
        )
        self.descend = nn.ModuleList(
            nn.Conv2d(a, b, 1) for a, b in zip((neck[1], neck[2], size.deep), neck, strict=True)
        )
        self.smooth = nn.ModuleList(conv(width, width) for width in neck)
        self.head = conv(neck[0], neck[0])
        self.heat = nn.Conv2d(neck[0], len(CLASSES), 1)
        self.votes = nn.Conv2d(neck[0], 4 * len(CLASSES), 1)
        self.fine = nn.Conv2d(neck[0], size.fine, 1)
        self.blend = conv(size.fine + w2, size.fine)
        self.mask = nn.Conv2d(size.fine, len(CLASSES), 1)
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
        finest, *levels, deepest = self.encoder(photo)
        x = self.pool(deepest)
        for k in (2, 1, 0):
            up = functional.interpolate(self.descend[k](x), scale_factor=2.0, mode="nearest")
            x = self.smooth[k](functional.relu(self.lateral[k](levels[k]) + up))
        head = self.head(x)
        votes = self.votes(head).float().clamp(-4.0, 4.0).exp() * _UNIT
        fine = functional.interpolate(
            self.fine(x), scale_factor=2.0, mode="bilinear", align_corners=False
        )
        mask = self.mask(self.blend(torch.cat([fine, finest], dim=1)))
        return self.heat(head).float(), votes, mask.float()


def build_net(size: NetSize | dict[str, Any] | None = None, imagenet: bool = False) -> VoteNet:
    """Return a new network.

    Parameters
    ----------
    size : size, also as saved in a checkpoint; None is the shipped network's.
    imagenet : whether the encoder starts from ImageNet weights instead of random ones.

    Raises
    ------
    InputError : the size is of another kind of network, or has no ImageNet weights.
    EnvironmentLacksError : the package of the ImageNet weights is not installed.
    """
    if isinstance(size, dict):
        if size.keys() != NetSize().as_dict().keys():
            raise InputError(f"a network of another architecture: {', '.join(sorted(size))}")
        size = NetSize(**{**size, "neck": tuple(size["neck"])})
    net = VoteNet(size or NetSize())
    if imagenet:
        load_imagenet(net.encoder, imagenet_file(net.size.width, net.size.depth))
    return net
