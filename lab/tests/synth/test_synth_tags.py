"""Start tags are drawn as the truth says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from walltopo_lab.synth.gym import SetUp, set_up
from walltopo_lab.synth.marks import TAG_SIZE
from walltopo_lab.synth.paint import PaintWork, paint_facet
from walltopo_lab.synth.params import GymSettings
from walltopo_lab.synth.truth import tag_record

PLAIN = GymSettings(
    width=3.0, height=3.0, columns=3, volumes=0, routes=3, downclimb=0, facets=0.0, detail=0.3
)


@pytest.fixture(scope="module")
def built() -> SetUp:
    return set_up(PLAIN, 3)


def test_tags_lie_where_the_truth_tells(built: SetUp) -> None:
    """Between band and text the bitmap is paper; half a tag beyond the rim it is wall."""
    work = PaintWork(replace(PLAIN, chalk=0.0, wear=0.0), 0, built.holds, {})
    checked = 0
    for number, facet in enumerate(built.wall):
        before = len(work.tags)
        canvas = paint_facet(facet, work, np.random.default_rng([3, 11, number]))
        # The last tag of a facet is covered by no other.
        for tag in work.tags[before:][-1:]:
            if tag.shown < 1:
                continue
            checked += 1
            for x, y, paper in ((-0.4, 0.0, True), (0.93, 0.0, True), (1.5, 0.0, False)):
                at = canvas.pixels(facet.chart(tag.position + x * tag.right + y * tag.up))
                column, row = np.clip(at.astype(int), 0, np.array(canvas.image.shape[1::-1]) - 1)
                value = canvas.image[row, column]
                assert (np.abs(value - (0.9, 0.9, 0.88)).max() < 0.02) == paper, (x, value)
    assert checked >= 1


def test_each_start_hold_on_the_wall_has_one_tag_below_it(built: SetUp) -> None:
    work = PaintWork(PLAIN, 0, built.holds, {})
    for number, facet in enumerate(built.wall):
        paint_facet(facet, work, np.random.default_rng([3, 11, number]))
    starts = {hold.id: hold for hold in built.holds if hold.role == "start"}
    assert {tag.hold for tag in work.tags} == set(starts)
    assert sum(tag.shown == 1 for tag in work.tags) >= len(starts) / 2
    for tag in work.tags:
        hold = starts[tag.hold]
        assert tag.route == hold.route
        assert np.linalg.norm(tag.position - hold.position) < 0.4
        assert tag.position[2] < hold.position[2]
        np.testing.assert_allclose([tag.right @ tag.normal, tag.up @ tag.normal], 0, atol=1e-12)
        record = tag_record(tag)
        assert (record["width_m"], record["height_m"]) == pytest.approx(TAG_SIZE)
