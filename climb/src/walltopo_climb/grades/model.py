"""The grade model: from features to a difficulty on the Font scale, with an error bound.

The difficulty comes from monotone gradient boosting (an ONNX tree ensemble, trained by
`walltopo_lab.train.grades`). The range around it is split conformal (Vovk et al. 2005; Lei et al.
2018): as wide as needed to cover the stated share of held-out problems.
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
    """A grade range.

    Parameters
    ----------
    low, high : indices into `FONT`, both included.
    coverage : share of climbs whose grade such ranges contain.
    graded : number of the gym's grades behind the calibration.
    """

    low: int
    high: int
    coverage: float
    graded: int = 0


class Errors(msgspec.Struct, frozen=True):
    """The model's errors on held-out problems, in steps of `FONT`.

    Parameters
    ----------
    spread : standard deviation.
    bound : maximum error of the share `coverage` of the problems.
    """

    spread: float
    bound: float
    coverage: float


class Learnt(msgspec.Struct, frozen=True):
    """The training range and errors of a model: enough for a range around a difficulty.

    Parameters
    ----------
    known, plain : errors with known quality of the holds, and with their positions alone.
    easiest, hardest : indices into `FONT` of the easiest and hardest grade of the training data.
    """

    known: Errors
    plain: Errors
    easiest: int
    hardest: int

    def errors(self, known: bool) -> Errors:
        """Return the expected errors; `known`: whether the holds' quality is known."""
        return self.known if known else self.plain

    def bounded(self, difficulty: float, known: bool) -> Range:
        """Return the range of a climb without any grades of the gym.

        The range is open at the ends of the training data: a board has no easy problems.
        """
        errors = self.errors(known)
        low, high = range_of(difficulty, errors.bound)
        if difficulty - errors.bound <= self.easiest:
            low = 0
        if difficulty + errors.bound >= self.hardest:
            high = len(FONT) - 1
        return Range(low, high, errors.coverage)


@dataclass(frozen=True, eq=False)
class GradeModel:
    """A loaded grade model.

    Parameters
    ----------
    learnt : statistics of the training: the errors to expect, and the range of grades.
    """

    network: Network
    learnt: Learnt

    @classmethod
    def load(cls, path: Path) -> GradeModel:
        """Return the model of a file.

        Raises
        ------
        InputError : the file is not a grade model, or has other features.
        """
        network = open_network(path)
        try:
            about = json.loads(network.metadata["grades"])
            if about["features"] != list(FEATURES):
                raise InputError(f"{path}: a grade model with other features", "Retrain it.")
            known, plain = (msgspec.convert(about[name], Errors) for name in ("known", "plain"))
            easiest, hardest = FONT.index(about["easiest"]), FONT.index(about["hardest"])
        except (KeyError, ValueError, msgspec.ValidationError) as error:
            raise InputError(f"{path}: not a grade model ({error})") from error
        return cls(network, Learnt(known, plain, easiest, hardest))

    def difficulties(self, features: npt.NDArray[np.float32]) -> Floats:
        """Return (N,) difficulties, fractional indices into `FONT` of (N, F) features."""
        if not len(features):
            return np.zeros(0)
        name = self.network.session.get_inputs()[0].name
        (found,) = self.network.session.run(None, {name: np.asarray(features, np.float32)})
        return np.asarray(found, float).ravel()


def range_of(difficulty: float, bound: float) -> tuple[int, int]:
    """Return the grades within `bound` of a difficulty, at least one."""
    low, high = int(np.ceil(difficulty - bound)), int(np.floor(difficulty + bound))
    if low > high:
        low = high = round(difficulty)
    last = len(FONT) - 1
    return min(max(low, 0), last), min(max(high, 0), last)


@cache
def shipped_model() -> GradeModel:
    """Return the model that comes with the package."""
    return GradeModel.load(_shipped_model())


@cache
def shipped_identity() -> str:
    """Return the hash of the model's file: estimates of two models are not comparable."""
    return hash_path(_shipped_model())[:16]


def _shipped_model() -> Path:
    return Path(str(resources.files("walltopo_climb") / "models" / "grades.onnx"))
