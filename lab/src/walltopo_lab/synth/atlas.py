"""One array of all facets' bitmaps with three coarser copies each, for the shader."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet
from walltopo_lab.synth.paint import PaintWork, paint_facet

LEVELS = 4


@dataclass(frozen=True, eq=False)
class Atlas:
    """The bitmaps of the facets.

    Parameters
    ----------
    texels : (N, 3) uint8 sRGB, all bitmaps row after row.
    levels : (K, LEVELS, 3) int64: offset into `texels`, width, height; each level halves the size.
    charts : (K, 12) float64: origin, u, v (world, metres), low u, low v, texel size.
    """

    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    charts: NDArray[np.float64]


def build_atlas(facets: Sequence[Facet], work: PaintWork, seed: int) -> Atlas:
    """Paint every facet; facet k has its own random stream (seed, k)."""
    import cv2

    pieces: list[NDArray[np.uint8]] = []
    levels = np.zeros((len(facets), LEVELS, 3), np.int64)
    charts = np.zeros((len(facets), 12))
    offset = 0
    for number, facet in enumerate(facets):
        canvas = paint_facet(facet, work, np.random.default_rng([seed, 11, number]))
        u, v, _ = facet.frame
        charts[number] = [*facet.corners[0], *u, *v, *canvas.low, canvas.texel]
        image = np.round(canvas.image * 255).astype(np.uint8)
        for level in range(LEVELS):
            h, w = image.shape[:2]
            levels[number, level] = offset, w, h
            pieces.append(image.reshape(-1, 3))
            offset += h * w
            # A texel of a level spans two of the level before, also where their number is odd.
            even = cv2.copyMakeBorder(image, 0, h % 2, 0, w % 2, cv2.BORDER_REPLICATE)
            half = ((w + 1) // 2, (h + 1) // 2)
            image = np.asarray(cv2.resize(even, half, interpolation=cv2.INTER_AREA), np.uint8)
    return Atlas(np.concatenate(pieces), levels, charts)
