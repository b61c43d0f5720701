"""Convert HDR pictures (HLG and PQ, as phones film them) to sRGB.

Source: ITU-R BT.2100-2 (transfer functions), BT.2087 (primaries) and BT.2408-7 (reference white of
203 cd/m2, at 75 % of an HLG signal).
"""

from __future__ import annotations

from functools import cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Transfer = Literal["pq", "hlg"]
Floats = NDArray[np.float32]

# Code points of ITU-T H.273, which video streams and HEIF's NCLX boxes use.
TRANSFERS: Final[dict[int, Transfer]] = {16: "pq", 18: "hlg"}

_WHITE_NITS: Final = 203.0
_HLG_PEAK_NITS: Final = 1000.0
_HLG_GAMMA: Final = 1.2  # of the system, for a display of 1,000 cd/m2
# Linear BT.2020 to linear BT.709 (BT.2087, annex 2), whose primaries sRGB has.
_TO_709: Final = np.array(
    [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]],
    dtype=np.float32,
)
_LUMA_2020: Final = np.array([0.2627, 0.6780, 0.0593], dtype=np.float32)
_KNEE: Final = 0.9  # linear light from which highlights are compressed instead of cut
_STEPS: Final = 4096
_ROWS: Final = 128


Signal = NDArray[np.uint8] | NDArray[np.uint16]


def to_srgb8(signal: Signal, transfer: Transfer) -> NDArray[np.uint8]:
    """Return (H, W, 3) sRGB of an HDR picture; diffuse white becomes 249.

    Parameters
    ----------
    signal : (H, W, 3) uint8 or uint16, R'G'B' of BT.2020 over the type's whole range.
    """
    result = np.empty(signal.shape, dtype=np.uint8)
    for top in range(0, len(signal), _ROWS):  # floats of a whole frame would take 400 MB
        result[top : top + _ROWS] = _rows_to_srgb8(signal[top : top + _ROWS], transfer)
    return result


def _rows_to_srgb8(signal: Signal, transfer: Transfer) -> NDArray[np.float32]:
    steps = signal.astype(np.float32) * ((_STEPS - 1) / np.iinfo(signal.dtype).max)
    light = _transfer_table(transfer)[(steps + 0.5).astype(np.int32)]
    if transfer == "hlg":
        # The display's light depends on the scene's luminance, not on each channel alone.
        luma = np.maximum(light @ _LUMA_2020, 1e-6)
        light *= (luma ** (_HLG_GAMMA - 1))[..., None] * (_HLG_PEAK_NITS / _WHITE_NITS)
    shown = _compress_highlights(np.maximum(light @ _TO_709.T, 0.0))
    return _srgb_table()[(shown * (_STEPS - 1) + 0.5).astype(np.int32)]


def _compress_highlights(light: Floats) -> Floats:
    """Return light in [0, 1]: unchanged up to the knee, highlights above it drawn together."""
    over = np.maximum(light - _KNEE, 0.0)
    room = 1.0 - _KNEE
    return np.minimum(light, _KNEE) + room * over / (over + room)


@cache
def _transfer_table(transfer: Transfer) -> Floats:
    """Return linear light by signal: PQ relative to diffuse white, HLG relative to its peak."""
    signal = np.linspace(0.0, 1.0, _STEPS)
    if transfer == "pq":
        m1, m2, c1, c2, c3 = 0.1593017578125, 78.84375, 0.8359375, 18.8515625, 18.6875
        root = signal ** (1 / m2)
        nits = 10_000.0 * (np.maximum(root - c1, 0.0) / (c2 - c3 * root)) ** (1 / m1)
        return (nits / _WHITE_NITS).astype(np.float32)
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    low, high = signal**2 / 3.0, (np.exp((signal - c) / a) + b) / 12.0
    return np.where(signal <= 0.5, low, high).astype(np.float32)


@cache
def _srgb_table() -> NDArray[np.float32]:
    """Return the codes of sRGB by linear light."""
    light = np.linspace(0.0, 1.0, _STEPS)
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.rint(255.0 * curve).astype(np.float32)
