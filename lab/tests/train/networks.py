"""Small networks of the shipped kind."""

from __future__ import annotations

import torch

from walltopo_lab.train.net import NetSize, VoteNet

SMALL = NetSize(width=0.1, depth=0.3, neck=(8, 8, 8), deep=8, fine=4)


def trained_norms(net: VoteNet) -> VoteNet:
    """Give all normalisations and biases values of their own (equal ones are exported once)."""
    torch.manual_seed(3)
    for parameter in net.parameters():
        if parameter.ndim == 1:
            torch.nn.init.normal_(parameter, 0.0, 0.1)
    for module in net.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            for values in (module.weight, module.bias, module.running_mean):
                torch.nn.init.normal_(values, 0.5, 0.3)
            torch.nn.init.uniform_(module.running_var, 0.5, 2.0)
    return net
