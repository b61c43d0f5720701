"""Losses of the three network outputs."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

_CLASS_WEIGHTS = (1.0, 3.0)  # hold, volume: there are ten holds per volume


def _class_weight(classes: int, like: Tensor) -> Tensor:
    """Return the (1, C, 1, 1) weight of each class."""
    return like.new_tensor(_CLASS_WEIGHTS[:classes]).view(1, classes, 1, 1)


def heat_loss(logits: Tensor, target: Tensor, weight: Tensor) -> Tensor:
    """Return the focal loss, with less weight near peaks (CornerNet; Law and Deng, ECCV 2018)."""
    p = torch.sigmoid(logits)
    at_peak = (target >= 1.0).float()
    positive = at_peak * (1 - p) ** 2 * functional.softplus(-logits)
    negative = (1 - at_peak) * (1 - target) ** 4 * p**2 * functional.softplus(logits)
    total = (positive + negative) * weight * _class_weight(logits.shape[1], logits)
    return total.sum() / at_peak.sum().clamp(min=8.0)


def box_loss(votes: Tensor, target: Tensor, weight: Tensor) -> Tensor:
    """Return the weighted mean of 1 - GIoU of boxes given as distances from the same pixel.

    Parameters
    ----------
    votes, target : (n, 4 C, h, w), pixels > 0.
    weight : (n, C, h, w).
    """
    n, channels, h, w = votes.shape
    shape = (n, channels // 4, 4, h, w)
    pick = weight > 0
    v = votes.view(shape).permute(0, 1, 3, 4, 2)[pick]
    t = target.view(shape).permute(0, 1, 3, 4, 2)[pick]
    share = (weight * _class_weight(weight.shape[1], votes))[pick]
    if len(share) == 0:
        return votes.sum() * 0.0
    overlap = torch.minimum(v, t)
    around = torch.maximum(v, t)

    def area(d: Tensor) -> Tensor:
        return (d[:, 0] + d[:, 2]) * (d[:, 1] + d[:, 3])

    inside = area(overlap)
    union = area(v) + area(t) - inside
    hull = area(around)
    giou = inside / union - (hull - union) / hull
    return ((1 - giou) * share).sum() / share.sum()


def mask_loss(logits: Tensor, target: Tensor, weight: Tensor) -> Tensor:
    """Return the weighted cross entropy plus the soft Dice loss of each class."""
    entropy = functional.binary_cross_entropy_with_logits(logits, target, reduction="none") * weight
    p = torch.sigmoid(logits) * (weight > 0)
    t = target * (weight > 0)
    both = (p * t * weight).sum(dim=(0, 2, 3))
    either = ((p + t) * weight).sum(dim=(0, 2, 3))
    dice = 1 - (2 * both + 50.0) / (either + 50.0)
    return entropy.mean() + 0.5 * dice.mean()
