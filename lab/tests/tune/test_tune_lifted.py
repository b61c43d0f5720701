"""A trial costs what its settings changed, and gives what a lift from scratch gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walltopo.core import Mask, Silent, View
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.blocks import blocks_of
from walltopo.segment.lift.evidence import Sampling, gather_evidence
from walltopo.segment.lift.label_image import drawing_order
from walltopo.segment.lift.settings import Method
from walltopo_lab.tune.lift_task import LiftTask, LiftWall, load_lift_wall
from walltopo_lab.tune.lifted import Lifted
from walltopo_lab.tune.seen import SeenOnce
from walltopo_lab.tune.walls import Wall


@pytest.fixture
def wall(tmp_path: Path, make_gym: Callable[[Path], None]) -> LiftWall:
    """The tiny wall, its masks shifted a little so that borders are in doubt."""
    make_gym(tmp_path / "t")
    loaded = load_lift_wall(Wall("a", "train", tmp_path / "t"))
    views = tuple(
        view.with_masks(tuple(_shifted(mask, k + m) for m, mask in enumerate(view.masks)))
        for k, view in enumerate(loaded.views)
    )
    return replace(loaded, views=views)


def _shifted(mask: Mask, seed: int) -> Mask:
    x = mask.x + int(np.random.default_rng(seed).integers(-3, 4))
    return replace(mask, x=min(max(x, 0), mask.width - mask.bitmap.shape[1]), score=0.5 + seed / 40)


@pytest.mark.parametrize(("distance", "power"), [(8.0, 0.0), (2.0, 0.5), (2.1, -0.8)])
def test_seen_once_gives_what_a_fresh_look_gives(
    wall: LiftWall, distance: float, power: float
) -> None:
    def drawing(view: View) -> list[int]:
        return drawing_order(view, "small")

    sampling = Sampling(distance, power)
    fresh = gather_evidence(blocks_of(wall.mesh), wall.views, drawing, sampling, Silent())
    cached = SeenOnce(wall.mesh, wall.views, drawing, Sampling(20.0)).evidence(distance, power)
    for name in ("faces", "starts", "projection", "view", "first_mask", "label"):
        assert (getattr(fresh, name) == getattr(cached, name)).all(), name
    assert cached.ease == pytest.approx(fresh.ease, abs=1e-4)


@pytest.mark.parametrize("method", ["literal", "robust"])
def test_a_remembered_lift_is_the_lift(wall: LiftWall, method: Method) -> None:
    lifted = Lifted(wall.mesh, wall.views, 20.0, 12.0 if method == "robust" else 0.0)
    rng = np.random.default_rng(3)
    found = 0
    for trial in range(8):
        params = LiftParams(
            method=method,
            # Rounded: settings come back to where they were, as the search's do at its bounds.
            visibility_distance=float(np.round(rng.uniform(1.8, 2.6), 1)),
            easing_power=float(np.round(rng.uniform(-1, 1))),
            threshold=float(np.round(rng.uniform(0.2, 0.8), 1)),
            resolution=float(rng.choice([0.5, 1.0, 20.0])),
            cohesion=float(rng.choice([0.1, 0.5])),
            border_band=float(rng.choice([0.0, 2.0, 12.0])),
            on_top="surest" if trial % 3 else "small",
            by_class=bool(rng.integers(2)),
            overlap="all" if trial % 2 else "covisible",
            voters="all" if trial > 5 else "holders",
            normalised=trial == 7,
        )
        remembered, fresh = lifted(params), lift(wall.mesh, wall.views, params)
        assert (remembered.face_instance == fresh.face_instance).all(), params
        assert remembered.face_score == pytest.approx(fresh.face_score, abs=1e-4)
        assert [r.label for r in remembered.records] == [r.label for r in fresh.records]
        scores = [r.score for r in fresh.records]
        assert [r.score for r in remembered.records] == pytest.approx(scores, abs=1e-4)
        found += len(fresh)
    assert found > 8


def test_a_trial_costs_what_it_changes(wall: LiftWall) -> None:
    """Counted, not timed: how often each step is computed for each setting that changes."""
    task = LiftTask([wall], "literal")
    defaults = {r.name: r.default for r in task.ranges}

    def cost(**changed: float) -> set[str]:
        before = task.lifted[0].done.copy()
        task.evaluate({**defaults, **changed})
        return set(task.lifted[0].done - before)

    assert cost() == {"look", "weigh", "compare", "cluster", "decide"}
    assert cost() == {"decide"}
    assert cost(threshold=0.3) == {"decide"}
    assert cost(resolution=4.0) == {"cluster", "decide"}
    assert cost(easing_power=0.5) == {"weigh", "compare", "cluster", "decide"}
    assert cost(visibility_distance=2.5) == {"weigh", "compare", "cluster", "decide"}
    assert task.lifted[0].done["look"] == 1


def test_a_robust_trial_costs_what_it_changes(wall: LiftWall) -> None:
    task = LiftTask([wall], "robust")
    defaults = {r.name: r.default for r in task.ranges}

    def cost(**changed: float) -> set[str]:
        before = task.lifted[0].done.copy()
        task.evaluate({**defaults, **changed})
        return set(task.lifted[0].done - before)

    assert cost() == {"look", "weigh", "compare", "decide"}
    assert cost(threshold=0.3, cohesion=0.5, min_support=0.3) == {"decide"}
    assert cost(border_band=9.0) == {"weigh", "decide"}
    assert cost(visibility_distance=2.5) == {"weigh", "compare", "decide"}
    assert task.lifted[0].done["look"] == 1


def test_two_scans_of_one_wall_are_kept_apart(wall: LiftWall) -> None:
    nothing_seen: tuple[View, ...] = tuple(view.with_masks(view.masks[:1]) for view in wall.views)
    task = LiftTask([wall, replace(wall, views=nothing_seen)], "literal", "ap25")
    figures = task.evaluate({r.name: r.default for r in task.ranges})
    assert set(figures) == {"a #1", "a #2"}
    assert figures["a #1"] > 3 * figures["a #2"]
