"""The type of a hold from its shape alone: jug, crimp, sloper, pinch, pocket, foothold.

One Gaussian per type over eight measures of the shape, fitted to the generator's holds by
`python -m benchmarks.hold_types fit`. A type is named only if it is clearly the likeliest and
the hold looks like one of the holds the model knows; otherwise the answer is "unknown".
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from walltopo.routes.geometry import Shape

__all__ = ["TypeModel", "measures", "shipped_model"]

Floats = NDArray[np.float64]


def measures(shape: Shape, unit: float) -> Floats:
    """(8,) what the model looks at; lengths in metres by `unit` scan units a metre."""
    size, width = max(shape.size_m, 1e-6), max(shape.width_m, 1e-6)
    depth = max(shape.protrusion_m, 1e-6)
    return np.array(
        [
            np.log(size / unit),
            np.log(width / size),
            np.log(depth / width),
            shape.upright,
            shape.hollow,
            shape.ledge,
            shape.faces_up,
            shape.incut,
        ]
    )


@dataclass(frozen=True, eq=False)
class TypeModel:
    """A Gaussian per type.

    Parameters
    ----------
    names : the types; means : (k, 8); precisions : (k, 8, 8) inverse covariances.
    offsets : (k,) half log determinants of the precisions.
    certain : probability from which a type is named.
    familiar : largest squared Mahalanobis distance to the named type.
    """

    names: tuple[str, ...]
    means: Floats
    precisions: Floats
    offsets: Floats
    certain: float
    familiar: float

    def name(self, values: Floats) -> tuple[str, float]:
        """The type of a hold with these measures, or "unknown", and its probability."""
        away = values - self.means
        distance = np.einsum("ki,kij,kj->k", away, self.precisions, away)
        score = self.offsets - 0.5 * distance
        odds = np.exp(score - score.max())
        best = int(score.argmax())
        probability = float(odds[best] / odds.sum())
        if probability < self.certain or distance[best] > self.familiar:
            return "unknown", probability
        return self.names[best], probability


@cache
def shipped_model() -> TypeModel:
    """The model in `models/hold_types.json`."""
    text = resources.files("walltopo").joinpath("models/hold_types.json").read_text("utf-8")
    data = json.loads(text)
    precisions = np.array(data["precisions"])
    return TypeModel(
        tuple(data["names"]),
        np.array(data["means"]),
        precisions,
        0.5 * np.linalg.slogdet(precisions)[1],
        float(data["certain"]),
        float(data["familiar"]),
    )
