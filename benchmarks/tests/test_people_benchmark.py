"""The benchmark of people in photos: cut out, paste."""

from __future__ import annotations

import numpy as np
from benchmarks.people import cut_out, paste


def test_a_person_is_cut_out_and_pasted() -> None:
    rng = np.random.default_rng(0)
    photo = rng.normal((60, 160, 60), 5, (200, 150, 3)).clip(0, 255).astype(np.uint8)
    photo[50:150, 60:90] = rng.normal((200, 40, 40), 5, (100, 30, 3)).clip(0, 255)
    colours, cover = cut_out(photo, (50, 40, 100, 160))
    assert colours.shape == (100, 30, 3)
    assert cover.mean() > 0.95
    wall = np.full((300, 400, 3), 128, dtype=np.uint8)
    truth = paste(wall, (colours, cover), 60, rng)
    rows, columns = np.nonzero(truth)
    assert np.ptp(rows) + 1 == 60
    assert np.ptp(columns) + 1 == 18
    assert (wall[truth][:, 0] > 150).mean() > 0.9
    assert (wall[~truth] == 128).mean() > 0.98
