"""Where a card's edges are in the plane of the wall, and how much of a card it is.

A card is white paper with print in it, and may have a coloured band along one side. On a light
wall the paper hardly differs from the paint, and only its sides, averaged along their length,
stand out of the grain; so each side is looked for by itself, where the paper begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.imaging.oklab import oklab_from_linear
from walltopo.imaging.srgb import linear_from_srgb8

__all__ = ["CORNERS", "EVIDENCE", "GRID", "PRINT", "CardFit", "fit_card"]

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Box = tuple[int, int, int, int]  # x0, x1, y0, y1 in pixels of the grid

GRID = 88  # pixels of a side of the patch that a card is fitted in
MARGIN = 9  # of these, that must remain around it
SEARCH = (-9, 5)  # pixels outwards and inwards of the first guess in which a side is looked for
INK = 0.65  # of the paper's luminance, below which a pixel may be print
BAND = 0.2  # of the card's length: where a band along a side is looked for
CORNER = 0.15  # of each side, that belongs to a corner
BAND_LEVEL = 0.35  # of the paper's contrast, by which a band differs from the wall
DEEPEST = 0.6  # of the paper's length: depth of a band
LEAST_CONTRAST = 5.0  # 8-bit levels by which paper is whiter than the wall
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True, eq=False)
class CardFit:
    """A card in a patch.

    Parameters
    ----------
    box : x0, x1, y0, y1 in pixels of the patch.
    evidence : (10,) what speaks for a card: see `EVIDENCE`.
    linear : (3,) linear RGB of a coloured band; None without one.
    """

    box: Box
    evidence: Floats
    linear: Floats | None

    @property
    def straight(self) -> float:
        """How well the box lies along the card's sides: its third side and its corners."""
        return float(self.evidence[1] + self.evidence[CORNERS])


EVIDENCE = (
    "worst side",  # rise of whiteness into the card over its contrast, the four sides sorted
    "third side",
    "second side",
    "best side",
    "contrast",  # log of the paper's whiteness over the wall's, in 8-bit levels
    "paper",  # share of the card that is paper
    "print",  # share that is dark
    "spill",  # share of its surroundings as white as the paper
    "chroma",  # of the paper
    "corners",  # share of the two fullest corners that differs from the wall
)


CORNERS, PRINT = EVIDENCE.index("corners"), EVIDENCE.index("print")


def _step(profile: Floats) -> Floats:
    """Mean of the three values after a place, less that of the three before it, a gap between.

    Before it should be wall (0): what is darker is no better than wall, and what differs from
    it either way counts against the place.
    """
    total = np.concatenate([[0.0], np.cumsum(profile)])
    mean = (total[3:] - total[:-3]) / 3  # of profile[k : k + 3]
    rise = np.full(len(profile), -np.inf)
    at = np.arange(4, len(profile) - 4)
    before = mean[at - 4]
    rise[at] = mean[at + 1] - np.maximum(before, 0.0) - 0.3 * np.abs(before)
    return rise


def _quantile(rows: Floats, share: float) -> Floats:
    """`np.quantile(rows, share, axis=0)`, ten times as fast on tables as small as a card."""
    order = np.sort(rows, axis=0)
    place = share * (len(order) - 1)
    low = int(place)
    high = min(low + 1, len(order) - 1)
    return np.asarray(order[low] + (place - low) * (order[high] - order[low]))


def _sides(white: Floats, off: Floats, box: Box) -> tuple[Box, list[float]] | None:
    """Move the four sides of a box to where paper begins; and how far whiteness rises there.

    A side at which the card differs from the wall far more than paper does is a band's, and
    stays where it is.
    """
    moved, rises = list(box), []
    for side in range(4):
        rows, offs = (white, off) if side < 2 else (white.T, off.T)
        low, high = (moved[2], moved[3]) if side < 2 else (moved[0], moved[1])
        if high - low < 5:
            return None
        # Print covers less than 40 % of a line along the side; a band all of it.
        profile = _quantile(rows[low + 1 : high - 1], 0.6)
        far = _quantile(offs[low + 1 : high - 1], 0.5)
        at = box[side]
        if side % 2:
            profile, far, at = profile[::-1], far[::-1], len(profile) - at
        begin = max(at + SEARCH[0], 4)
        rise = _step(profile)[begin : at + SEARCH[1]]
        if len(rise) == 0:
            return None
        best = int(rise.argmax())
        jump = float(far[at + 1 : at + 4].mean() - far[at - 4 : at - 1].mean())
        found = at if jump > 3 * max(float(rise[best]), 1.0) else begin + best
        moved[side] = len(profile) - found if side % 2 else found
        rises.append(float(rise[best]))
    x0, x1, y0, y1 = moved
    return ((x0, x1, y0, y1), rises) if x1 - x0 >= 6 and y1 - y0 >= 6 else None


def _around(box: Box, out: int, gap: int) -> Mask:
    """(GRID, GRID) the frame around a box, `gap` to `out` pixels away."""
    x0, x1, y0, y1 = box
    frame = np.zeros((GRID, GRID), dtype=np.bool_)
    frame[max(y0 - out, 0) : y1 + out, max(x0 - out, 0) : x1 + out] = True
    frame[max(y0 - gap, 0) : y1 + gap, max(x0 - gap, 0) : x1 + gap] = False
    return frame


def _with_band(off: Floats, box: Box, contrast: float) -> Box:
    """The box with the band beside it, where paper alone was fitted.

    A band differs from the wall along all of one side, begins there, is no deeper than
    `DEEPEST` of the card, and does not go on past the corners, as a hold would.
    """
    limit = max(BAND_LEVEL * contrast, 12.0)
    best, deepest = box, 2
    for side in range(4):
        rows = off if side < 2 else off.T
        low, high = (box[2], box[3]) if side < 2 else (box[0], box[1])
        length = box[1] - box[0] if side < 2 else box[3] - box[2]
        lines, at = (rows[:, ::-1], box[side]) if side % 2 == 0 else (rows, GRID - box[side])
        beyond = lines[:, GRID - at :]  # columns from the side outwards
        along = _quantile(beyond[low + 1 : high - 1], 0.3) > limit
        begin = int(along[:3].argmax())
        run = int(np.append(~along[begin:], True).argmax()) if along[:3].any() else 0
        if run <= deepest or begin + run > DEEPEST * length:
            continue
        flanks = np.concatenate([beyond[max(low - 5, 0) : low - 2], beyond[high + 2 : high + 5]])
        if np.median(flanks[:, begin : begin + run]) < limit:
            sign = -1 if side % 2 == 0 else 1
            moved = list(box)
            moved[side] = min(max(box[side] + sign * (begin + run), 0), GRID)
            best, deepest = (moved[0], moved[1], moved[2], moved[3]), run
    return best


def _band(linear: Floats, paper: Mask) -> Floats | None:
    """Colour of the band along one side, or of coloured print; None where there is none."""
    height, width = paper.shape
    deep, high = max(2, round(BAND * width)), max(2, round(BAND * height))
    strips = (
        np.s_[1:-1, 1:deep],
        np.s_[1:-1, -deep:-1],
        np.s_[1:high, 1:-1],
        np.s_[-high:-1, 1:-1],
    )
    shares = [1 - float(paper[strip].mean()) if paper[strip].size else 0.0 for strip in strips]
    best = int(np.argmax(shares))
    if shares[best] >= 0.75:
        return np.asarray(np.median(linear[strips[best]].reshape(-1, 3), axis=0))
    lab = oklab_from_linear(linear)
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    coloured = ~paper & (chroma > float(np.median(chroma[paper])) + 0.06)
    if coloured.mean() < 0.1:
        return None
    return np.asarray(np.median(linear[coloured], axis=0))


def _corners(card: Mask) -> float:
    """Share of the two fullest corners of a box that is card: rounded things have no corners.

    The other two may be a band's, of the wall's colour.
    """
    card = card[1:-1, 1:-1]  # blur makes boxes a little large
    high, wide = (max(2, round(CORNER * size)) for size in card.shape)
    shares = [float(card[y, x].mean()) for y in np.s_[:high, -high:] for x in np.s_[:wide, -wide:]]
    return sum(sorted(shares)[2:]) / 2


def fit_card(patch: Image, box: Box) -> CardFit | None:
    """Fit a card to a patch in the wall's plane, starting from a box; None where none fits.

    Parameters
    ----------
    patch : (GRID, GRID, 3) uint8 RGB, its axes along the card's.
    box : x0, x1, y0, y1 of what differs from the wall: the card, or print and band alone.
    """
    if min(box[0], box[2]) < MARGIN or max(box[1], box[3]) > GRID - MARGIN:
        return None
    wall = np.median(patch[_around(box, 16, 6)], axis=0)
    white = patch.min(axis=2) - float(wall.min())
    off = np.abs(patch - wall).max(axis=2)
    rises: list[float] = []
    for _ in range(2):
        found = _sides(white, off, box)
        if found is None:
            return None
        box, rises = found
    contrast = float(np.percentile(white[box[2] : box[3], box[0] : box[1]], 75))
    if contrast < LEAST_CONTRAST:
        return None
    if min(rises) > 0.4 * contrast:  # paper begins at all four sides; else the band's is among them
        box = _with_band(off, box, contrast)
    inner = patch[box[2] : box[3], box[0] : box[1]]
    whiteness = white[box[2] : box[3], box[0] : box[1]]
    linear = linear_from_srgb8(inner)
    luminance = linear @ LUMINANCE
    paper = whiteness > contrast / 2
    ink = (luminance < INK * float(np.percentile(luminance, 75))) & ~paper
    spill = white[_around(box, 5, 1)] > contrast / 2
    lab = np.median(oklab_from_linear(linear[paper]), axis=0)
    chroma = float(np.hypot(lab[1], lab[2]) / max(float(lab[0]), 1e-3))
    sides = np.clip(sorted(rise / contrast for rise in rises), -1, 2)
    corners = _corners(off[box[2] : box[3], box[0] : box[1]] > contrast / 2)
    shares = [float(part.mean()) for part in (paper, ink, spill)]
    evidence = np.array([*sides, np.log(contrast), *shares, chroma, corners])
    return CardFit(box, evidence, _band(linear, paper))
