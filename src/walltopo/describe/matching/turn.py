"""How far a hold turned and moved between two scans, from its patches in both.

Every turn is tried with every shift: the new patch is turned back and compared with the old one
where the hold was, by the weighted sum of squared differences of height and colour, whose mean is
taken out, because light changes between two scans. All shifts of a turn are compared at once by
the Fourier transform, as in template matching (J. P. Lewis, "Fast normalized cross-correlation",
1995).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, rfft2

from walltopo.describe.matching.patches import CELLS, INSIDE

Floats = NDArray[np.float64]

# By how much height (metres) and the three channels of OKLab may differ at an untouched hold. Light
# does not turn with a hold, and meshes are coarse for small ones, so that hues count most.
_SPREAD: Final = np.array([0.03, 0.3, 0.02, 0.02])
_COARSE_DEG: Final = 6.0
_FINE_DEG: Final = 1.5
_STILL_DEG: Final = 3.0
_CAP: Final = 100.0  # of one channel's error: what is wholly different is not ever more so
_PADDED: Final = (2 * CELLS, 2 * CELLS)
_FEW: Final = 30  # cells of a hold, below which nothing can be compared


@dataclass(frozen=True)
class Fit:
    """The best agreement of two patches at one turn.

    Parameters
    ----------
    turn : degrees, counter-clockwise seen from the climber, in (-180, 180].
    shift : (right, up) cells. error : mean squared difference, in squared spreads.
    """

    turn: float
    shift: tuple[float, float]
    error: float


def fit_patches(old: Floats, new: Floats, reach: int, still: int) -> tuple[Fit, Fit] | None:
    """Return the best fit of two patches, and the best with neither turn nor shift.

    Parameters
    ----------
    old, new : (CELLS, CELLS, 5) patches of one window.
    reach : the largest shift that is tried, cells. still : the largest that counts as none.

    Returns
    -------
    None if the old patch shows too little of its hold.
    """
    weight = _weight(old)
    if weight.sum() < _FEW:
        return None
    compare, source = _Comparison(_filled(old), weight), _filled(new)
    coarse = [compare.at(source, turn, reach) for turn in np.arange(-180.0, 180.0, _COARSE_DEG)]
    middle = min(coarse, key=lambda fit: fit.error).turn
    around = np.arange(-_COARSE_DEG, _COARSE_DEG + 0.1, _FINE_DEG)
    level = np.arange(-_STILL_DEG, _STILL_DEG + 0.1, _FINE_DEG)
    unmoved = min((compare.at(source, turn, still) for turn in level), key=lambda fit: fit.error)
    fine = [compare.at(source, middle + turn, reach) for turn in around]
    return min([*fine, unmoved], key=lambda fit: fit.error), unmoved


def _weight(patch: Floats) -> Floats:
    """Return the weights of the cells: those of the hold and of its rim."""
    inside = np.nan_to_num(patch[:, :, INSIDE])
    rim = cv2.dilate(inside, np.ones((5, 5), np.uint8))
    return np.asarray(rim, np.float64) * np.isfinite(patch[:, :, 0])


def _filled(patch: Floats) -> Floats:
    """Return height and colour in spreads, without their medians, and 0 where nothing was hit."""
    scaled = patch[:, :, :INSIDE] / _SPREAD
    middle = np.nanmedian(scaled.reshape(-1, scaled.shape[2]), axis=0)
    return np.nan_to_num(scaled - middle)


class _Comparison:
    """The old patch, transformed once for all turns; channels first, in single precision."""

    def __init__(self, template: Floats, weight: Floats) -> None:
        self._total = float(weight.sum())
        weighted = np.moveaxis(template * weight[:, :, None], 2, 0)
        self._weight = _spectrum(weight[None]).conj()
        self._weighted = _spectrum(weighted).conj()
        self._square = (np.moveaxis(template, 2, 0) * weighted).sum(axis=(1, 2))[:, None, None]
        self._sum = weighted.sum(axis=(1, 2))[:, None, None]

    def at(self, source: Floats, turn: float, reach: int) -> Fit:
        """Return the best fit of the new patch, turned back by `turn` degrees."""
        turned = np.moveaxis(_turned_back(source, turn), 2, 0)
        values = _spectrum(turned)
        near = np.arange(-reach, reach + 1)
        squares, products, sums = (
            irfft2(spectrum, s=_PADDED)[:, near[:, None], near[None]]
            for spectrum in (
                _spectrum(turned**2) * self._weight,
                values * self._weighted,
                values * self._weight,
            )
        )
        mean = sums - self._sum
        difference = squares - 2 * products + self._square - mean**2 / self._total
        error = np.minimum(difference / self._total, _CAP).mean(axis=0)
        row, column = (int(k) for k in np.unravel_index(int(error.argmin()), error.shape))
        across = near[column] + _lowest_between(error[row], column)
        down = near[row] + _lowest_between(error[:, column], row)
        return Fit(_wrapped(turn), (float(across), -float(down)), float(error[row, column]))


def _lowest_between(errors: Floats, lowest: int) -> float:
    """Return where a parabola through the lowest error and its neighbours is lowest, from it."""
    if not 0 < lowest < len(errors) - 1:
        return 0.0
    before, here, after = errors[lowest - 1 : lowest + 2].tolist()
    bend = before - 2 * here + after
    return 0.5 * (before - after) / bend if bend > 0 else 0.0


def _spectrum(values: Floats) -> NDArray[np.complex64]:
    """Return the transform of (C, CELLS, CELLS) values, padded so that shifts do not wrap."""
    return np.asarray(rfft2(values.astype(np.float32), s=_PADDED))


def _turned_back(source: Floats, turn: float) -> Floats:
    """Return a patch turned clockwise by degrees about its middle."""
    middle = (CELLS - 1) / 2
    # OpenCV turns counter-clockwise for positive angles.
    matrix = cv2.getRotationMatrix2D((middle, middle), -turn, 1.0)
    return np.asarray(cv2.warpAffine(source, matrix, (CELLS, CELLS), flags=cv2.INTER_LINEAR))


def _wrapped(turn: float) -> float:
    return float(turn - 360.0 * np.ceil((turn - 180.0) / 360.0))
