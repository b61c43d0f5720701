"""Training and export of the small networks that one core trains in minutes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from walltopo.core import Progress
from walltopo_lab.onnx_file import label_export, save_model

BATCH, RATE = 64, 3e-3

Net = TypeVar("Net", bound=nn.Module)


def conv_block(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    """Return a 3x3 convolution with batch normalisation and ReLU."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
    )


def train_net(
    make: Callable[[], Net],
    loss_of: Callable[[Net, Tensor, torch.Generator], Tensor],
    count: int,
    epochs: int,
    seed: int,
    progress: Progress,
) -> Net:
    """Return a network trained from random weights, in eval mode.

    Training uses one thread, so that the same seed gives the same network.

    Parameters
    ----------
    make : returns the network with random weights.
    loss_of : the loss of the network on a batch, given the numbers of its samples.
    count : number of samples; a last incomplete batch of an epoch is left out.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    rng = torch.Generator().manual_seed(seed)
    net = make()
    batches = count // BATCH
    optimizer = torch.optim.AdamW(net.parameters(), RATE, weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, RATE, total_steps=epochs * batches, pct_start=0.15
    )
    for epoch in range(epochs):
        total = 0.0
        for rows in torch.randperm(count, generator=rng)[: batches * BATCH].split(BATCH):
            loss = loss_of(net, rows, rng)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += float(loss.detach())
        progress.note(f"seed {seed}, epoch {epoch + 1}: loss {total / batches:.3f}")
    return net.eval()


def export_net(
    net: nn.Module,
    path: Path,
    inputs: Mapping[str, Tensor],
    outputs: Sequence[str],
    facts: Mapping[str, Any],
) -> None:
    """Write a network as ONNX with metadata.

    Parameters
    ----------
    inputs : an example of each input, by its name in `net.forward`; batches of up to 4,096 are
        possible.
    outputs : names of the outputs.
    facts : key to a value that JSON can hold.
    """
    count = torch.export.Dim("count", min=1, max=4096)
    program = torch.onnx.export(
        net.eval(),
        tuple(inputs.values()),
        dynamo=True,
        input_names=list(inputs),
        output_names=list(outputs),
        dynamic_shapes={name: {0: count} for name in inputs},
        verbose=False,
    )
    assert program is not None
    model = program.model_proto
    label_export(model, {key: json.dumps(value) for key, value in facts.items()})
    save_model(model, path)
