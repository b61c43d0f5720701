"""Export of the trained network as a self-describing ONNX file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from walltopo.core import StageError
from walltopo.images.networks import open_network
from walltopo_lab.onnx_file import label_export, save_model
from walltopo_lab.train.net import CLASSES, VoteNet


def fuse(net: VoteNet) -> VoteNet:
    """Return a copy of the network in eval mode, with normalisation folded into convolutions."""
    import copy

    from torch.nn.utils.fusion import fuse_conv_bn_eval

    net = copy.deepcopy(net).cpu().float().eval()
    for module in list(net.modules()):
        if isinstance(module, nn.Sequential) and len(module) >= 2:
            first, second = module[0], module[1]
            if isinstance(first, nn.Conv2d) and isinstance(second, nn.BatchNorm2d):
                module[0] = fuse_conv_bn_eval(first, second)
                module[1] = nn.Identity()
    return net


class _Deployed(nn.Module):
    """Wrapper from (n, H, W, 3) uint8 RGB to heat and mask probabilities and votes in pixels."""

    def __init__(self, net: VoteNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, photo: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        heat, votes, mask = self.net(photo.permute(0, 3, 1, 2).float())
        return torch.sigmoid(heat), votes, torch.sigmoid(mask)


def export_onnx(
    net: VoteNet, path: Path, metadata: dict[str, Any] | None = None, half: bool = True
) -> float:
    """Write the network as ONNX with class names, input, preprocessing and thresholds.

    Parameters
    ----------
    half : store the weights as float16 (ONNX Runtime still computes in float32).

    Returns
    -------
    Largest difference of the heat and mask outputs from PyTorch's, on noise.
    """

    deployed = _Deployed(fuse(net)).eval()
    example = torch.randint(0, 256, (2, 128, 160, 3), dtype=torch.uint8)
    photos, rows, cols = (
        torch.export.Dim("photos", min=1, max=256),
        torch.export.Dim("rows32", min=1, max=256),
        torch.export.Dim("cols32", min=1, max=256),
    )
    program = torch.onnx.export(
        deployed,
        (example,),
        dynamo=True,
        input_names=["photo"],
        output_names=["heat", "votes", "mask"],
        dynamic_shapes={"photo": {0: photos, 1: 32 * rows, 2: 32 * cols}},
        verbose=False,
    )
    model = program.model_proto
    facts = {
        "head": "votes",
        "names": json.dumps(list(CLASSES)),
        "stride": "32",
        "input": "uint8 RGB (n, H, W, 3); the network scales it itself",
        "score": "0.3",
        "nms": "0.5",
        **{k: v if isinstance(v, str) else json.dumps(v) for k, v in (metadata or {}).items()},
    }
    label_export(model, facts)
    save_model(model, path, half)
    return _difference(deployed, path, example)


def _difference(deployed: nn.Module, path: Path, example: Tensor) -> float:
    session = open_network(path).session
    photo = torch.randint(0, 256, (1, 192, 256, 3), dtype=torch.uint8)
    worst = 0.0
    for tensor in (example, photo):
        with torch.no_grad():
            expected = deployed(tensor)
        got = session.run(None, {"photo": tensor.numpy()})
        for k in (0, 2):
            worst = max(worst, float(np.abs(got[k] - expected[k].numpy()).max()))
    if not np.isfinite(worst) or worst > 0.05:
        raise StageError(
            f"{path}: the exported network differs from the trained one by {worst:.3f}"
        )
    return worst
