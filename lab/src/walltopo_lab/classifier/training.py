"""Training of the cutout network on labelled cutouts, and its export as ONNX."""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from walltopo.core import Progress, StageError
from walltopo.core.files import atomic_path
from walltopo.images.networks import open_network
from walltopo_lab.classifier.cutout_classifier import judge_cutouts, to_json
from walltopo_lab.classifier.net import CutoutNet
from walltopo_lab.classifier.params import ClassifierSettings
from walltopo_lab.classifier.samples import Cutouts
from walltopo_lab.classifier.split import hold_split
from walltopo_lab.onnx_file import label_export

Bools = NDArray[np.bool_]
RIGHT = 0.9


@dataclass(frozen=True, eq=False)
class Trained:
    """A trained network and its accuracy on held-out holds.

    Parameters
    ----------
    net : the network in eval mode, with the weights of the best epoch.
    accuracy : share of the held-out holds that are classified correctly, over all their cutouts.
    per_cutout : share of the held-out cutouts that are classified correctly.
    epoch : the best one; holds : numbers of (training, held-out) holds.
    certain : lowest confidence from which `RIGHT` of the classified held-out holds are correct.
    """

    net: CutoutNet
    accuracy: float
    per_cutout: float
    epoch: int
    holds: tuple[int, int]
    certain: float


def _augment_cutouts(
    pictures: Tensor, settings: ClassifierSettings, rng: torch.Generator
) -> Tensor:
    """Return (n, 3, s, s) augmented cutouts.

    The augmentation mirrors, rotates, scales and shifts, and changes brightness and hue.
    """
    count = len(pictures)

    def uniform(low: float, high: float) -> Tensor:
        return torch.rand(count, generator=rng) * (high - low) + low

    angle = torch.deg2rad(uniform(-settings.rotation, settings.rotation))
    scale, mirror = uniform(0.88, 1.2), torch.where(uniform(0, 1) < 0.5, -1.0, 1.0)
    turn = torch.zeros(count, 2, 3)
    turn[:, 0, 0], turn[:, 0, 1] = mirror * angle.cos() * scale, -angle.sin() * scale
    turn[:, 1, 0], turn[:, 1, 1] = mirror * angle.sin() * scale, angle.cos() * scale
    turn[:, :, 2] = torch.stack([uniform(-0.08, 0.08), uniform(-0.08, 0.08)], dim=1)
    grid = functional.affine_grid(turn, list(pictures.shape), align_corners=False)
    moved = functional.grid_sample(pictures, grid, padding_mode="border", align_corners=False)
    if settings.hue > 0:
        moved = _other_hue(moved, uniform(-settings.hue, settings.hue))
    gain = uniform(0.65, 1.4)[:, None, None, None]
    return (moved * gain).clamp(0, 1)


def _other_hue(pictures: Tensor, shift: Tensor) -> Tensor:
    """Return images with hues rotated by `shift` (n,), a share of the circle, in RGB."""
    angle = 2 * torch.pi * shift
    c, s = angle.cos(), angle.sin()
    third, root = (1 - c) / 3, s / 3**0.5
    same, up, down = c + third, third - root, third + root
    rows = [
        torch.stack([same, up, down], 1),
        torch.stack([down, same, up], 1),
        torch.stack([up, down, same], 1),
    ]
    return torch.einsum("nij,njhw->nihw", torch.stack(rows, 1), pictures).clamp(0, 1)


def _tensor(pictures: NDArray[np.uint8]) -> Tensor:
    return torch.from_numpy(pictures).permute(0, 3, 1, 2).float() / 255


def _confidences_of(net: CutoutNet, pictures: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the (n, classes) confidences."""
    net.eval()
    with torch.no_grad():
        blocks = [net(_tensor(part)) for part in np.array_split(pictures, 8) if len(part)]
    return np.asarray(torch.softmax(torch.cat(blocks), dim=1).numpy(), dtype=np.float64)


def _measure_accuracy(net: CutoutNet, cutouts: Cutouts, held: Bools) -> tuple[float, float, float]:
    """Return the accuracy per hold and per cutout, and `Trained.certain`."""
    chance = _confidences_of(net, cutouts.pictures[held])
    label, hold = cutouts.label[held], cutouts.hold[held]
    confidences, right = [], []
    for number in np.unique(hold):
        rows = np.flatnonzero(hold == number)
        verdict = judge_cutouts(chance[rows], np.ones(len(rows)), cutouts.names)
        confidences.append(verdict.confidence)
        right.append(verdict.name == cutouts.names[label[rows[0]]])
    single = float((chance.argmax(axis=1) == label).mean())
    return float(np.mean(right)), single, _certain_level(np.array(confidences), np.array(right))


def _certain_level(confidences: NDArray[np.float64], right: Bools) -> float:
    """Return the lowest of 20 levels from which `RIGHT` of the verdicts are correct, else 1."""
    for level in np.arange(0.0, 1.0, 0.05):
        named = confidences >= level
        if named.any() and right[named].mean() >= RIGHT:
            return round(float(level), 2)
    return 1.0


def train(cutouts: Cutouts, settings: ClassifierSettings, progress: Progress) -> Trained:
    """Train from random weights; keep the epoch with the best held-out accuracy.

    All classes have the same weight, regardless of their number of cutouts.
    """
    torch.manual_seed(settings.seed)
    torch.set_num_threads(settings.threads)
    rng = torch.Generator().manual_seed(settings.seed)
    held = hold_split(cutouts, settings.held_out, settings.seed)
    pictures, label = cutouts.pictures[~held], torch.from_numpy(cutouts.label[~held])
    share = torch.bincount(label, minlength=len(cutouts.names)).float() / len(label)
    weight = 1 / (len(cutouts.names) * share.clamp(min=1e-6))
    net = CutoutNet(len(cutouts.names))
    steps = settings.epochs * max(1, len(label) // settings.batch)
    optimizer = torch.optim.AdamW(net.parameters(), lr=settings.rate, weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, settings.rate, total_steps=steps)
    best: tuple[float, float, float, int, dict[str, Any]] = (-1.0, 0.0, 0.0, 0, {})
    taken = max(1, len(label) // settings.batch) * settings.batch
    progress.step("training", settings.epochs)
    for epoch in range(1, settings.epochs + 1):
        net.train()
        order = torch.randperm(len(label), generator=rng)
        for first in range(0, taken, settings.batch):
            rows = order[first : first + settings.batch]
            seen = _augment_cutouts(_tensor(pictures[rows.numpy()]), settings, rng)
            loss = functional.cross_entropy(net(seen), label[rows], weight, label_smoothing=0.05)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
        accuracy, single, certain = _measure_accuracy(net, cutouts, held)
        if accuracy >= best[0]:
            state = {name: value.clone() for name, value in net.state_dict().items()}
            best = (accuracy, single, certain, epoch, state)
        progress.detail(f"epoch {epoch}: {accuracy:.3f} of the held-out holds right")
        progress.advance()
    net.load_state_dict(best[4])
    counts = len(np.unique(cutouts.hold[~held])), len(np.unique(cutouts.hold[held]))
    return Trained(net.eval(), best[0], best[1], best[3], counts, best[2])


class _Deployed(nn.Module):
    def __init__(self, net: CutoutNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, pictures: Tensor) -> Tensor:
        return torch.softmax(self.net(pictures), dim=1)


def write_onnx(trained: Trained, cutouts: Cutouts, path: Path) -> None:
    """Write the network with its class names and their meaning; verify it against PyTorch.

    Raises
    ------
    StageError : the written file gives different results.
    """
    import onnx

    # The exporter logs every torchvision operator that it lacks.
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    side = cutouts.pictures.shape[1]
    deployed = _Deployed(trained.net).eval()
    example = _tensor(cutouts.pictures[:2])
    program = torch.onnx.export(
        deployed,
        (example,),
        dynamo=True,
        input_names=["cutouts"],
        output_names=["confidence"],
        dynamic_shapes={"pictures": {0: torch.export.Dim("n", min=1, max=4096)}},
        verbose=False,
    )
    assert program is not None
    model = program.model_proto
    facts = {
        "names": json.dumps(list(cutouts.names)),
        "classes": to_json(cutouts.meanings),
        "side": str(side),
        "accuracy": f"{trained.accuracy:.4f}",
        "certain": str(trained.certain),
    }
    label_export(model, facts)
    with atomic_path(path) as temporary:
        onnx.save(model, temporary)
    session = open_network(path).session
    got = session.run(None, {"cutouts": example.numpy()})[0]
    with torch.no_grad():
        worst = float(np.abs(got - deployed(example).numpy()).max())
    if not worst < 1e-3:
        raise StageError(f"{path}: the exported network differs from the trained one by {worst}")
