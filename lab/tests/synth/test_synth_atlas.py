"""The coarser copies of a bitmap lie where the bitmap lies."""

from __future__ import annotations

import numpy as np

from walltopo.images.markers import STICKER_MARGIN, STICKER_SIDE
from walltopo_lab.synth import GymSettings
from walltopo_lab.synth.atlas import LEVELS, build_atlas
from walltopo_lab.synth.bodies import Facet
from walltopo_lab.synth.paint import PaintWork
from walltopo_lab.synth.stickers import STICKER_PAPER


def test_a_print_keeps_its_size_in_every_level() -> None:
    side = STICKER_PAPER
    corners = np.array([(0, 0, 0), (side, 0, 0), (side, side, 0), (0, side, 0)], dtype=np.float64)
    facet = Facet(corners, "sticker", texel=0.0005, style=3)
    atlas = build_atlas([facet], PaintWork(GymSettings(), 0, [], {}), seed=0)
    for level in range(LEVELS):
        offset, wide, high = atlas.levels[0, level]
        size = 0.0005 * 2**level
        rows = atlas.texels[offset : offset + wide * high, 0].reshape(high, wide)
        # The black border of the marker lies along its upper edge.
        row = rows[round((STICKER_MARGIN + STICKER_SIDE - 0.003) / size - 0.5)]
        dark = 235.0 - row
        dark /= dark.max()  # a coarse texel may hold some of the paper above
        assert abs(dark.sum() * size - STICKER_SIDE) < 1e-4, level
        middle = (dark * (np.arange(wide) + 0.5)).sum() / dark.sum() * size
        assert abs(middle - side / 2) < 1e-4, level
