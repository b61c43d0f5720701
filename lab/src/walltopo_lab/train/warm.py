"""Training from the weights of an exported network, such as the shipped one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from walltopo.core import InputError
from walltopo_lab.train.net import VoteNet, build_net


def load_exported(path: Path) -> VoteNet:
    """Return the trainable network of an ONNX file of `walltopo train`.

    The export folded the batch normalisations into the convolutions. They are restored as
    normalisations that only add the folded bias. Their statistics must be frozen
    (`freeze_norms`) or be measured (`measure_norms`), or the first batch would rescale every layer.

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
        _copy_weights(net, arrays)
    except Exception as error:  # protobuf, json and shapes each raise their own exception types
        raise InputError(
            f"{path}: not a network that `walltopo train` exported ({error})",
            "Ultralytics' networks are trained further with Ultralytics.",
        ) from error
    return net


def _copy_weights(net: VoteNet, arrays: dict[str, NDArray[np.generic]]) -> None:
    """Copy the folded weights; biases go to the normalisation of each convolution."""
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
            norm = modules[f"{name.removesuffix('.0')}.1"]
            assert isinstance(norm, nn.BatchNorm2d)
            norm.bias.copy_(bias)
            # So that 1 / sqrt(var + eps) is exactly 1.
            assert norm.running_var is not None
            norm.running_var.fill_(1.0 - norm.eps)


def freeze_norms(net: nn.Module) -> None:
    """Freeze the statistics of all batch normalisations."""
    for module in net.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.eval()


@torch.no_grad()
def measure_norms(net: nn.Module, photos: Iterable[Tensor]) -> None:
    """Set the statistics of all batch normalisations to those of `photos`.

    Weights and biases are adjusted, so that the network's function in eval mode is unchanged.

    Parameters
    ----------
    photos : batches of input, (n, 3, H, W) float RGB in 0..255.
    """
    norms = [module for module in net.modules() if isinstance(module, nn.BatchNorm2d)]
    sums = {norm: torch.zeros(3, norm.num_features, dtype=torch.float64) for norm in norms}
    hooks = [norm.register_forward_pre_hook(_channel_summer(sums[norm])) for norm in norms]
    net.eval()
    for photo in photos:
        net(photo)
    for hook in hooks:
        hook.remove()
    for norm, (count, total, squares) in sums.items():
        assert norm.running_mean is not None
        assert norm.running_var is not None
        mean = total / count
        variance = (squares / count - mean**2).clamp(min=1e-6)
        gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        shift = norm.bias - gain * norm.running_mean
        norm.weight.copy_(gain * torch.sqrt(variance + norm.eps))
        norm.bias.copy_(shift + gain * mean)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)


def _channel_summer(sums: Tensor) -> Callable[[nn.Module, tuple[Tensor, ...]], None]:
    """Return a hook that adds count, sum and sum of squares of each channel of its input."""

    def add(_: nn.Module, inputs: tuple[Tensor, ...]) -> None:
        x = inputs[0].double()
        sums[0] += x.numel() / x.shape[1]
        sums[1] += x.sum(dim=(0, 2, 3))
        sums[2] += (x * x).sum(dim=(0, 2, 3))

    return add
