"""How likely two holds are of one route, from their paint and where they are.

For scans whose light is too uneven to name colours. Four cues: the path between the holds, how
far they are apart sideways, and how far apart the chroma and the lightness of their paint are.
The paint is white-balanced by the wall around each hold first: the wall within about a metre
is mostly of one paint, so what changes in its tint from place to place is the light.

A logistic regression on the cues and their squares, fitted to photos of generated gyms in dim,
mixed light by `walltopo train paint`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.imaging.oklab import features

__all__ = [
    "FAINT",
    "FLATTEN",
    "REACH",
    "RESOLUTION",
    "SHARPEN",
    "balanced_paint",
    "cues_of",
    "likeness",
    "may_be_linked",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

REACH = 2.2  # metres: flattened paths from which on two holds are never linked
FLATTEN = 0.2  # factor on the vertical part of a path; the fit knows no other
SHARPEN = 3  # power of the probability: Louvain wants few, sure links
RESOLUTION = 2.0  # of Louvain, over all colours
FAINT = 0.01  # links below are left out

WEIGHTS = (1.396, -3.006, -18.504, -2.768, 0.324, -1.729, 0.201, -10.911)
BIAS = 3.026


def balanced_paint(linear: Floats, tint: Floats) -> Floats:
    """(n, 3) paint of holds under one light: chroma (2) and lightness, see `oklab.features`.

    Parameters
    ----------
    linear : (n, 3) linear RGB of the holds, under one exposure.
    tint : (n, 3) > 0, relative colour of the light at each hold (`light.SceneLight.tint_at`).
        Only how it differs between holds counts: the wall's own paint is no light.
    """
    logs = np.log(tint)
    logs = logs - logs.mean(axis=1, keepdims=True)
    logs = logs - np.median(logs, axis=0)
    white = 0.8 / max(float(np.percentile(linear.mean(axis=1), 98)), 1e-9)
    return features(linear * np.exp(-logs) * white, 1.0)


def cues_of(points: Floats, paint: Floats, pairs: Ints, lengths: Floats) -> Floats:
    """(P, 8) the four cues of each pair and their squares.

    Parameters
    ----------
    points : (n, 3) positions, metres; paint : (n, 3) of `balanced_paint`.
    pairs : (P, 2) hold numbers; lengths : (P,) flattened path lengths, metres.
    """
    one, two = pairs[:, 0], pairs[:, 1]
    aside = np.linalg.norm(points[one, :2] - points[two, :2], axis=1)
    away = paint[one] - paint[two]
    chroma = np.linalg.norm(away[:, :2], axis=1)
    four = np.column_stack([lengths, aside, chroma, np.abs(away[:, 2])])
    return np.hstack([four, four**2])


def may_be_linked(points: Floats, paint: Floats, pairs: Ints) -> NDArray[np.bool_]:
    """(P,) whether a pair could have a link whatever the path between it turns out to be.

    The odds are convex in the length of the path, which lies between the straight, flattened line
    and `REACH`: no length in between gives more than the better of the two.
    """
    flat = points * np.array([1.0, 1.0, FLATTEN])
    straight = np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)
    longest = np.full(len(pairs), np.nextafter(REACH, 0.0))
    ends = [likeness(cues_of(points, paint, pairs, length)) for length in (straight, longest)]
    return np.asarray(np.maximum(*ends) > 0)


def likeness(cues: Floats) -> Floats:
    """(P,) weight in [0, 1] of the link of each pair: its probability, sharpened."""
    near = cues[:, 0] < REACH
    odds = np.where(near[:, None], cues, 0.0) @ np.array(WEIGHTS) + BIAS
    weight = np.where(near, 1 / (1 + np.exp(-odds)), 0.0) ** SHARPEN
    return np.where(weight < FAINT, 0.0, weight)
