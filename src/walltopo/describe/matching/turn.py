"""How far a hold turned and moved between two scans, from its patches in both.

Every turn is tried with every shift: the new patch is turned back and compared with the old one
where the hold was, by the weighted sum of squared differences of its features, whose means are
taken out, because light changes between two scans. Neither does light turn with a hold, so that
the features are what light changes least: hues, how much a cell has the hold's colour rather than
the wall's, and small details. All shifts of a turn are compared at once by the Fourier transform,
as in template matching (J. P. Lewis, "Fast normalized cross-correlation", 1995).
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

# By how much the features of an untouched hold may differ: likeness, hues, details.
_SPREAD: Final = np.array([0.25, 0.03, 0.03, 0.03])
_OF_LIGHTNESS: Final = 0.35  # its part in likeness, hues have 1
_LIKENESS: Final = (-0.2, 1.2)  # limits: shadows are no less the wall, highlights no more the hold
_DETAIL_CELLS: Final = 3.0  # standard deviation of the blur without which details remain
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
    old, new : (CELLS, CELLS, 4) patches of one window.
    reach : the largest shift that is tried, cells. still : the largest that counts as none.

    Returns
    -------
    None if the old patch shows too little of its hold.
    """
    weight = _cell_weights(old)
    if weight.sum() < _FEW:
        return None
    contrast = _Contrast.of(old, weight)
    compare, source = _Comparison(contrast.features(old), weight), contrast.features(new)
    coarse = [compare.at(source, turn, reach) for turn in np.arange(-180.0, 180.0, _COARSE_DEG)]
    middle = min(coarse, key=lambda fit: fit.error).turn
    around = np.arange(-_COARSE_DEG, _COARSE_DEG + 0.1, _FINE_DEG)
    level = np.arange(-_STILL_DEG, _STILL_DEG + 0.1, _FINE_DEG)
    unmoved = min((compare.at(source, turn, still) for turn in level), key=lambda fit: fit.error)
    fine = [compare.at(source, middle + turn, reach) for turn in around]
    return min([*fine, unmoved], key=lambda fit: fit.error), unmoved


def _cell_weights(patch: Floats) -> Floats:
    """Return the weights of the cells: those of the hold and of its rim."""
    inside = np.nan_to_num(patch[:, :, INSIDE])
    rim = cv2.dilate(inside, np.ones((5, 5), np.uint8))
    return np.asarray(rim, np.float64) * np.isfinite(patch[:, :, 0])


@dataclass(frozen=True, eq=False)
class _Contrast:
    """The colour of the wall around a hold, (3,), and the way from it to the hold's colour."""

    wall: Floats
    way: Floats

    @classmethod
    def of(cls, patch: Floats, weight: Floats) -> _Contrast:
        """Return the contrast of a patch; weights as `_cell_weights` returns them."""
        colours, shown = _weighted_colours(patch), np.isfinite(patch[:, :, INSIDE])
        of_hold, of_wall = (
            np.median(colours[part], axis=0) if part.any() else np.zeros(3)
            for part in (patch[:, :, INSIDE] > 0, shown & (weight == 0))
        )
        return cls(of_wall, of_hold - of_wall)

    def features(self, patch: Floats) -> Floats:
        """Return the (CELLS, CELLS, 4) features of a patch in spreads; 0 where nothing was hit."""
        along = (_weighted_colours(patch) - self.wall) @ self.way
        likeness = np.clip(along / max(float(self.way @ self.way), 1e-9), *_LIKENESS)
        found = np.dstack([likeness, patch[:, :, 1:3], _high_pass(patch[:, :, 0])]) / _SPREAD
        middle = np.nanmedian(found.reshape(-1, found.shape[2]), axis=0)
        return np.nan_to_num(found - middle)


def _weighted_colours(patch: Floats) -> Floats:
    return np.asarray(patch[:, :, :INSIDE] * np.array([_OF_LIGHTNESS, 1.0, 1.0]))


def _high_pass(lightness: Floats) -> Floats:
    """Return lightness without what is blurred in it."""
    filled = np.nan_to_num(lightness, nan=float(np.nanmedian(lightness)))
    return np.asarray(filled - cv2.GaussianBlur(filled, (0, 0), _DETAIL_CELLS))


class _Comparison:
    """The old patch, transformed once for all turns; channels first, in single precision."""

    def __init__(self, template: Floats, weight: Floats) -> None:
        self._total = float(weight.sum())
        weighted = np.moveaxis(template * weight[:, :, None], 2, 0)
        self._weight = _padded_spectrum(weight[None]).conj()
        self._weighted = _padded_spectrum(weighted).conj()
        self._square = (np.moveaxis(template, 2, 0) * weighted).sum(axis=(1, 2))[:, None, None]
        self._sum = weighted.sum(axis=(1, 2))[:, None, None]

    def at(self, source: Floats, turn: float, reach: int) -> Fit:
        """Return the best fit of the new patch, turned back by `turn` degrees."""
        turned = np.moveaxis(_turned_back(source, turn), 2, 0)
        values = _padded_spectrum(turned)
        near = np.arange(-reach, reach + 1)
        squares, products, sums = (
            irfft2(spectrum, s=_PADDED)[:, near[:, None], near[None]]
            for spectrum in (
                _padded_spectrum(turned**2) * self._weight,
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


def _padded_spectrum(values: Floats) -> NDArray[np.complex64]:
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
