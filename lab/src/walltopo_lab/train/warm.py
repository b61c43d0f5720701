"""Starting from a network that was exported before, such as the shipped one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from walltopo.core import InputError
from walltopo_lab.train.net import VoteNet, build_net


def load_exported(path: Path) -> VoteNet:
    """The network in an ONNX file of `walltopo train`, ready to be trained further.

    The export folded the batch normalisations into the convolutions. They come back as
    normalisations that only add the folded bias; their statistics must stay frozen
    (`freeze_norms`), or the first batch would rescale every layer.

    Raises
    ------
    InputError : no such file, or not a network of this kind.
    """
    import onnx

    if not path.is_file():
        raise InputError(f"{path}: no such model file")
    try:
        model = onnx.load(path)
        facts = {entry.key: entry.value for entry in model.metadata_props}
        net = build_net(json.loads(facts["size"]) if "size" in facts else None)
        arrays = {
            item.name.removeprefix("net.").removesuffix("_half"): onnx.numpy_helper.to_array(item)
            for item in model.graph.initializer
        }
        _fill(net, arrays)
    except Exception as error:  # protobuf, json and shapes each raise their own kinds
        raise InputError(
            f"{path}: not a network that `walltopo train` exported ({error})",
            "Ultralytics' networks are trained further with Ultralytics.",
        ) from error
    return net


def _fill(net: VoteNet, arrays: dict[str, NDArray[np.generic]]) -> None:
    """Copy the folded weights; biases go to the normalisation that was folded in."""
    modules = dict(net.named_modules())
    with torch.no_grad():
        for name, module in modules.items():
            if not isinstance(module, nn.Conv2d):
                continue
            values = arrays[f"{name}.weight"].astype(np.float32)
            module.weight.copy_(torch.from_numpy(values))
            bias = torch.from_numpy(arrays[f"{name}.bias"].astype(np.float32))
            if module.bias is not None:
                module.bias.copy_(bias)
                continue
            head, _, last = name.rpartition(".")
            norm = modules[f"{head}.norm" if last == "second" else f"{head}.1"]
            assert isinstance(norm, nn.BatchNorm2d)
            norm.bias.copy_(bias)
            # 1 / sqrt(var + eps) must be exactly 1.
            assert norm.running_var is not None
            norm.running_var.fill_(1.0 - norm.eps)


def freeze_norms(net: nn.Module) -> None:
    """Keep the statistics of all batch normalisations as they are."""
    for module in net.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.eval()
