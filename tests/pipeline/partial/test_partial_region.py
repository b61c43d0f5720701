"""A partial rescan replaces the triangles that it photographed."""

from __future__ import annotations

import numpy as np
import pytest
from tests.pipeline.partial.partial_walls import BUMP, STEP, Wall, photos_at

from walltopo.core import Mesh
from walltopo.pipeline.partial.region import (
    MARGIN,
    Region,
    replaced_region,
    seam_offsets,
    seen_places,
    whole_instances,
)

OLD = Wall(holds={1: (0.6, 1.0, 0.05), 2: (1.9, 1.0, 0.08), 3: (3.2, 1.0, 0.05)})
NEW = Wall(x=(0.0, 2.2), holds={1: (0.8, 0.6, 0.05), 2: (1.9, 1.0, 0.08)})
VIEWS = photos_at((0.4, 0.9), (0.7, 1.1), (0.9, 1.0))


def _region(old: Wall = OLD, new: Wall = NEW) -> tuple[Mesh, Mesh, Region, np.ndarray, np.ndarray]:
    (old_mesh, old_labels), (new_mesh, new_labels) = old.mesh(), new.mesh(0.001)
    region = replaced_region(old_mesh, old_labels, new_mesh, new_labels, VIEWS)
    return old_mesh, new_mesh, region, old_labels, new_labels


def test_what_two_photos_see_is_replaced_up_to_a_margin() -> None:
    old, _, region, _, _ = _region()
    x = old.centroids[:, 0]
    # The second photo reaches 1.143 m to the right of 0.7; 2 % of its side and the margin go off.
    end = 0.7 + 1.5 * 320 / 420 * 0.96 - MARGIN
    middle = np.abs(old.centroids[:, 2] - 1.0) < 0.5
    assert not region.old[(x > 0.3) & (x < end - 2 * STEP) & middle].any()
    assert region.old[x > end + 2 * STEP].all()


def test_the_new_surface_fills_the_replaced_region_and_no_more() -> None:
    old, new, region, _, new_labels = _region()
    replaced = old.areas[~region.old].sum()
    added = new.areas[region.new & (new_labels == 0)].sum()
    # Both overlap by 2 cm along the seam, so that it has no gap.
    assert replaced * 0.98 < added < replaced * 1.12
    assert new.centroids[region.new, 0].max() < 2.0


def test_instances_stay_or_go_whole() -> None:
    _, _, region, old_labels, new_labels = _region()
    for number in set(old_labels.tolist()) - {0}:
        assert len(set(region.old[old_labels == number].tolist())) == 1
    for number in set(region.new_labels.tolist()) - {0}:
        assert region.new[new_labels == number].all()
    assert not region.old[old_labels == 1].any()
    assert region.old[old_labels == 3].all()
    assert region.new[new_labels == 1].all()


def test_an_instance_that_reaches_beyond_the_border_stays_and_leaves_no_gap() -> None:
    end = 0.7 + 1.5 * 320 / 420 * 0.96 - MARGIN
    old, labels = Wall(holds={1: (end - 0.06, 1.0, 0.12)}).mesh()
    new, new_labels = Wall(x=(0.0, 2.2), holds={1: (end - 0.06, 1.0, 0.11)}).mesh()
    region = replaced_region(old, labels, new, new_labels, VIEWS)
    assert region.old[labels == 1].all()
    assert not region.new_labels.any()
    # Straight lines onto the wall hit something everywhere around the hold.
    around = np.abs(old.centroids[:, [0, 2]] - [end - 0.06, 1.0]).max(axis=1) < 0.2
    kept = np.vstack([old.centroids[region.old], new.centroids[region.new]])[:, [0, 2]]
    away = np.linalg.norm(old.centroids[around][:, None, [0, 2]] - kept[None], axis=2).min(axis=1)
    assert away.max() < STEP


def test_a_removed_volume_is_seen_through() -> None:
    mesh, _ = Wall(x=(0.0, 2.2)).mesh()
    volume = np.array([[0.7, -0.4, 1.0], [0.7, -BUMP, 1.0]])
    behind = np.array([[0.7, 0.2, 1.0]])
    far = np.array([[0.7, 0.9, 1.0]])
    beside = np.array([[0.7, 0.0, 2.05]])
    places = np.vstack([volume, behind, far, beside])
    seen, hidden, bare = seen_places(places, mesh, photos_at((0.6, 1.5), (0.8, 1.5)))
    assert seen.tolist() == [True, True, False, False, False]
    assert hidden.tolist() == [False, False, True, False, False]
    assert bare.tolist() == [False, False, False, False, True]


def test_a_new_volume_is_added_and_the_wall_behind_it_stays() -> None:
    old, labels = Wall().mesh()
    new, new_labels = Wall(x=(0.0, 2.2), holds={1: (0.7, 1.0, 0.25)}).mesh()
    region = replaced_region(old, labels, new, new_labels, VIEWS)
    assert region.new[new_labels == 1].all()
    behind = (np.abs(old.centroids[:, [0, 2]] - [0.7, 1.0]) < 0.1).all(axis=1)
    assert region.old[behind].all()


def test_nothing_is_replaced_where_the_new_mesh_has_a_hole() -> None:
    old, labels = OLD.mesh()
    new, new_labels = NEW.mesh()
    hole = (np.abs(new.centroids[:, [0, 2]] - [0.6, 1.0]) < 0.3).all(axis=1)
    holed = Mesh(new.vertices, new.faces[~hole])
    region = replaced_region(old, labels, holed, new_labels[~hole], VIEWS)
    inside = (np.abs(old.centroids[:, [0, 2]] - [0.6, 1.0]) < 0.3 - STEP).all(axis=1)
    assert region.old[inside].all()


def test_a_narrow_hole_of_the_new_mesh_is_not_closed_over() -> None:
    old, labels = Wall().mesh()
    new, new_labels = Wall(x=(0.0, 2.2)).mesh()
    slit = (np.abs(new.centroids[:, [0, 2]] - [0.6, 1.0]) < [0.06, 0.3]).all(axis=1)
    holed = Mesh(new.vertices, new.faces[~slit])
    region = replaced_region(old, labels, holed, new_labels[~slit], VIEWS)
    inside = (np.abs(old.centroids[:, [0, 2]] - [0.6, 1.0]) < [0.06 - STEP, 0.28]).all(axis=1)
    assert region.old[inside].all()
    # Around it, no more of the old wall stays.
    around = (np.abs(old.centroids[:, [0, 2]] - [0.6, 1.0]) < [0.2, 0.2]).all(axis=1)
    assert not region.old[around & (np.abs(old.centroids[:, 0] - 0.6) > 0.06 + 2 * STEP)].any()


def test_one_photo_replaces_nothing() -> None:
    (old, labels), (new, new_labels) = OLD.mesh(), NEW.mesh()
    region = replaced_region(old, labels, new, new_labels, VIEWS[:1])
    assert region.old.all()
    assert not region.new.any()


def test_the_seam_is_as_far_off_as_the_surfaces() -> None:
    (old, labels), (new, new_labels) = OLD.mesh(), NEW.mesh()
    moved = Mesh(new.vertices + [0.0, 0.004, 0.0], new.faces)
    region = replaced_region(old, labels, moved, new_labels, VIEWS)
    offsets = seam_offsets(old, labels, moved, region)
    assert len(offsets) > 50
    assert np.median(offsets) == pytest.approx(0.004, abs=1e-6)


def test_an_instance_is_chosen_as_a_whole() -> None:
    labels = np.array([1, 1, 1, 2, 2, 2, 0], dtype=np.int32)
    chosen = np.array([True, True, False, True, False, False, True])
    for share, first in ((0.5, True), (0.9, False)):
        whole = whole_instances(labels, chosen, share)
        assert whole.tolist() == [first, first, first, False, False, False, True]
