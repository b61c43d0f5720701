"""How likely a piece of surface is a hold, from what masks, mesh and photos say of it together.

Two logistic regressions on a few named cues, one for pieces that masks tell of and one for the
others, fitted on generated gyms (`walltopo_lab.benchmarks.evidence`); in `models/evidence.json`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import shipped_file
from walltopo.scans.document import Document
from walltopo.segment.propose.surroundings import Relief
from walltopo.segment.propose.tint import Tint

Floats = NDArray[np.float64]

CUES = (
    "height",
    "steps",
    "rim",
    "size",
    "size_squared",
    "long",
    "around",
    "company",
    "support",
    "best",
    "masks",
    "apart",
    "agreement",
    "photos",
)
# A piece that no mask tells of is explained by its colour where photos agree on so much of it.
APART, PHOTOS = 0.03, 2
SPECK = 0.0002  # square metres


@dataclass(frozen=True)
class Masks:
    """What masks say of a piece.

    Parameters
    ----------
    support : the lift's score, 0 where no mask was lifted to it.
    best : the best score that the detector gave to one of its masks, 0 where there is none.
    count : of its masks.
    """

    support: float = 0.0
    best: float = 0.0
    count: int = 0


class Weights(msgspec.Struct, frozen=True):
    """One logistic regression.

    Parameters
    ----------
    middle, spread : cues are taken less the first and over the second.
    weights, bias : of the regression.
    """

    middle: tuple[float, ...]
    spread: tuple[float, ...]
    weights: tuple[float, ...]
    bias: float

    def probability(self, cues: Floats) -> Floats:
        """(n,) of (n, len(CUES)) cues."""
        scaled = (cues - np.array(self.middle)) / np.array(self.spread)
        return np.asarray(1 / (1 + np.exp(-(scaled @ np.array(self.weights) + self.bias))))


class EvidenceModel(Document, frozen=True, kw_only=True):
    """A fitted model; a file of JSON.

    Parameters
    ----------
    cues : their names, in the order of the weights.
    masked, unmasked : of pieces that masks tell of, and of the others, where relief and colour
        weigh more.
    made_by : the command and its data, for people.
    """

    cues: tuple[str, ...]
    masked: Weights
    unmasked: Weights
    made_by: str = ""

    def __post_init__(self) -> None:
        both = (self.masked, self.unmasked)
        rows = [row for one in both for row in (one.middle, one.spread, one.weights)]
        if self.cues != CUES or any(len(row) != len(CUES) for row in rows):
            raise msgspec.ValidationError(f"expected the cues {', '.join(CUES)}")

    def probability(self, cues: Floats) -> Floats:
        """(n,) how likely each of n pieces is a hold; `cues` (n, len(CUES)) as of `cues_of`."""
        masked = cues[:, CUES.index("masks")] > 0
        return np.where(masked, self.masked.probability(cues), self.unmasked.probability(cues))


def cues_of(relief: Relief, masks: Masks, tint: Tint) -> Floats:
    """(len(CUES),) what the model is told of a piece, in the order of `CUES`."""
    size = float(np.clip(np.log(max(relief.area, 1e-6) / 0.01), -4, 4))
    return np.array(
        [
            np.clip(np.log(max(relief.height, 1e-4) / 0.01), -2, 3),
            np.clip(np.log(max(relief.height, 1e-4) / max(relief.noise, 2e-4)), -2, 5),
            relief.rim,
            size,
            size**2,
            np.log(max(relief.length, 1e-3) ** 2 / max(relief.area, 1e-6)),
            relief.around,
            np.log1p(relief.company),
            np.sqrt(masks.support),
            masks.best,
            np.log1p(masks.count),
            min(tint.apart, 0.3) / 0.1,
            tint.agreement,
            np.log1p(tint.photos),
        ]
    )


def explained(relief: Relief, masks: Masks, tint: Tint) -> bool:
    """Whether photos tell of a piece at all: by a mask, or by a colour that is not the wall's.

    A speck of few triangles is nothing that they could tell of.
    """
    by_colour = tint.apart >= APART and tint.photos >= PHOTOS
    return relief.area >= SPECK and (masks.count > 0 or by_colour)


@cache
def shipped_model() -> EvidenceModel:
    """The model in `models/evidence.json`."""
    return EvidenceModel.load(shipped_file("evidence.json"))
