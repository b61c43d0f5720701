"""The grade model: features to a place on the Font scale, and how far that may be off.

The place comes from monotone gradient boosting (an ONNX tree ensemble, learnt by
`walltopo_lab.train.grades`); the range around it is split conformal (Vovk et al. 2005; Lei et al.
2018): as wide as it had to be for the stated share of problems that were not learnt from.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

from walltopo.core import InputError
from walltopo.core.files import hash_path
from walltopo.images.networks import Network, open_network
from walltopo_climb.grades.features import FEATURES
from walltopo_climb.grades.font import FONT

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Range:
    """Places in `FONT`, both ends included; coverage: the share that such ranges hold.

    `graded`: how many grades of the gym it leans on.
    """

    low: int
    high: int
    coverage: float
    graded: int = 0


class Errors(msgspec.Struct, frozen=True):
    """What is known of the model's errors, in steps of `FONT`, on problems not learnt from.

    Parameters
    ----------
    spread : their standard deviation.
    bound : by at most that much were `coverage` of them off.
    """

    spread: float
    bound: float
    coverage: float


class Learnt(msgspec.Struct, frozen=True):
    """What a model was learnt from, and how far off it is: enough for a range around a place.

    Parameters
    ----------
    known, plain : errors where the holds' quality is known, and where their places alone are.
    easiest, hardest : places in `FONT` of the easiest and hardest grade that it was learnt from.
    """

    known: Errors
    plain: Errors
    easiest: int
    hardest: int

    def errors(self, known: bool) -> Errors:
        """Which errors to expect; `known`: whether the holds' quality was."""
        return self.known if known else self.plain

    def bounded(self, place: float, known: bool) -> Range:
        """The range of a climb of which the gym knows nothing.

        Open where it reaches the end of what was learnt: a board has no easy problem.
        """
        errors = self.errors(known)
        low, high = range_of(place, errors.bound)
        if place - errors.bound <= self.easiest:
            low = 0
        if place + errors.bound >= self.hardest:
            high = len(FONT) - 1
        return Range(low, high, errors.coverage)


@dataclass(frozen=True, eq=False)
class GradeModel:
    """A loaded model."""

    network: Network
    learnt: Learnt

    @classmethod
    def load(cls, path: Path) -> GradeModel:
        """Read and check a model.

        Raises
        ------
        InputError : no grade model, or one with other features.
        """
        network = open_network(path)
        try:
            about = json.loads(network.metadata["grades"])
            if about["features"] != list(FEATURES):
                raise InputError(f"{path}: a grade model with other features", "Train it anew.")
            known, plain = (msgspec.convert(about[name], Errors) for name in ("known", "plain"))
            easiest, hardest = FONT.index(about["easiest"]), FONT.index(about["hardest"])
        except (KeyError, ValueError, msgspec.ValidationError) as error:
            raise InputError(f"{path}: no grade model ({error})") from error
        return cls(network, Learnt(known, plain, easiest, hardest))

    def places(self, features: npt.NDArray[np.float32]) -> Floats:
        """(N,) place in `FONT`, a fraction, of (N, F) features."""
        if not len(features):
            return np.zeros(0)
        name = self.network.session.get_inputs()[0].name
        (found,) = self.network.session.run(None, {name: np.asarray(features, np.float32)})
        return np.asarray(found, float).ravel()


def range_of(place: float, bound: float) -> tuple[int, int]:
    """The grades within `bound` of a place, at least one."""
    low, high = int(np.ceil(place - bound)), int(np.floor(place + bound))
    if low > high:
        low = high = round(place)
    last = len(FONT) - 1
    return min(max(low, 0), last), min(max(high, 0), last)


@cache
def shipped_model() -> GradeModel:
    """The model that comes with the package."""
    return GradeModel.load(_shipped())


@cache
def shipped_identity() -> str:
    """Of its file: places of two models are not on one scale."""
    return hash_path(_shipped())[:16]


def _shipped() -> Path:
    return Path(str(resources.files("walltopo_climb") / "models" / "grades.onnx"))
