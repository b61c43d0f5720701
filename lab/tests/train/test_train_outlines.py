"""A network outlines the objects of labelled boxes."""

from __future__ import annotations

import numpy as np
import pytest
from lab.tests.train.networks import SMALL

from walltopo_lab.train import outlines
from walltopo_lab.train.cache import IGNORED, UNDECIDED, Sample
from walltopo_lab.train.net import build_net
from walltopo_lab.train.outlines import redraw

SIDE = 128
DISCS = ((32, 40, 12), (90, 40, 16), (60, 100, 10))  # x, y, radius; the last one has no label


def disc(x: int, y: int, r: int, side: int = SIDE, step: int = 1) -> np.ndarray:
    grid = np.arange(side // step) * step + step / 2
    return (grid[None, :] - x) ** 2 + (grid[:, None] - y) ** 2 <= r**2


def perfect_look(scale: float = 1.0) -> outlines._Look:
    """Outputs of a network that sees three holds exactly, at the photo's own size."""
    cells = SIDE // 4
    heat = np.zeros((2, cells, cells), np.float32)
    votes = np.ones((8, cells, cells), np.float32)
    mask = np.zeros((2, SIDE // 2, SIDE // 2), np.float32)
    centre = np.arange(cells) * 4 + 2.0
    for x, y, r in DISCS:
        inside = disc(x, y, r + 2, step=4)
        heat[0, y // 4, x // 4] = 0.9
        x_low, y_low = centre[None, :] - (x - r), centre[:, None] - (y - r)
        sides = (x_low, y_low, 2 * r - x_low, 2 * r - y_low)
        for k, distance in enumerate(sides):
            votes[k][inside] = np.broadcast_to(distance, inside.shape)[inside]
        mask[0] = np.maximum(mask[0], disc(x, y, r, step=2) * 0.9)
    return outlines._Look(heat, votes, mask, scale)


def sample_with(labelled: tuple[tuple[int, int, int], ...]) -> Sample:
    ids = np.zeros((SIDE, SIDE), np.int16)
    boxes = [[x - r, y - r, x + r, y + r] for x, y, r in labelled]
    for x0, y0, x1, y1 in boxes:
        ids[y0:y1, x0:x1] = UNDECIDED
    hulls = np.zeros((len(boxes), 16, 2), np.float32)
    image = np.zeros((SIDE, SIDE, 3), np.uint8)
    return Sample("a", image, ids, np.ones(len(boxes), int), np.array(boxes, np.float32), hulls)


def test_outlines_follow_the_network_in_labelled_boxes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outlines, "_mean_outputs", lambda net, photo, size: perfect_look())
    made = redraw(build_net(SMALL), sample_with(DISCS[:2]))
    for k, (x, y, r) in enumerate(DISCS[:2]):
        mine, true = made.ids == k + 1, disc(x, y, r)
        assert (mine & true).sum() / (mine | true).sum() > 0.85
        np.testing.assert_allclose(made.hulls[k].min(axis=0), [x - r, y - r], atol=0.01)
        np.testing.assert_allclose(made.hulls[k].max(axis=0), [x + r, y + r], atol=0.01)
    x, y, _ = DISCS[2]
    assert made.ids[y, x] == IGNORED, "nobody labelled this hold"


def test_an_outline_that_disagrees_with_its_box_is_not_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(outlines, "_mean_outputs", lambda net, photo, size: perfect_look())
    sample = sample_with(((32, 40, 24),))
    made = redraw(build_net(SMALL), sample)
    np.testing.assert_array_equal(made.ids[16:64, 8:56], sample.ids[16:64, 8:56])
    np.testing.assert_array_equal(made.hulls, sample.hulls)


def test_a_look_has_maps_of_the_photo() -> None:
    photo = np.zeros((40, 64, 3), np.uint8)
    look = outlines._mean_outputs(build_net(SMALL).eval(), photo, 128)
    assert look.scale == 2.0
    assert look.heat.shape == (2, 24, 32)
    assert look.votes.shape == (8, 24, 32)
    assert look.mask.shape == (2, 48, 64)
