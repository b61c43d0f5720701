"""Walls, volumes, routes and resets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import SettingsError
from walltopo_lab.synth import PRESETS, GymSettings, gym_preset
from walltopo_lab.synth.bodies import Facet, GymInstance
from walltopo_lab.synth.gym import Reset, set_up
from walltopo_lab.synth.light import hang_lamps
from walltopo_lab.synth.mesh import tessellate
from walltopo_lab.synth.tnuts import behind_fins
from walltopo_lab.synth.wall import build_wall

SMALL = GymSettings(width=5.0, height=3.4, columns=4, routes=5, volumes=3, detail=0.4, downclimb=2)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_wall_faces_the_climber_and_is_plane(preset: str, seed: int) -> None:
    settings_, _ = gym_preset(preset)
    for facet in build_wall(settings_, np.random.default_rng(seed)):
        _, _, normal = facet.frame
        assert normal[1] < 0.2, "a panel faces away"
        offsets = (facet.corners - facet.corners[0]) @ normal
        assert np.abs(offsets).max() < 1e-6
        assert facet.corners[:, 2].min() >= -1e-9


@given(
    corners=st.lists(
        st.tuples(*[st.floats(-3, 3, allow_nan=False, width=32)] * 3), min_size=3, max_size=3
    ),
    cell=st.floats(0.1, 2.0),
)
@settings(max_examples=60, deadline=None)
def test_tessellation_keeps_area(corners: list[tuple[float, float, float]], cell: float) -> None:
    triangle = np.array(corners, dtype=np.float64)
    points, faces = tessellate(triangle, cell)
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    whole = np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0]))
    assert area == pytest.approx(whole, rel=1e-6, abs=1e-6)


def _holds(reset: Reset | None, seed: int = 4) -> list[GymInstance]:
    return [i for i in set_up(SMALL, seed, reset).instances if i.label == "hold"]


def test_no_two_holds_overlap() -> None:
    holds = _holds(None)
    assert len(holds) > 25
    for k, one in enumerate(holds):
        for two in holds[:k]:
            assert one.body is not None
            assert two.body is not None
            gap = np.linalg.norm(one.position - two.position)
            assert gap > one.body.radius + two.body.radius - 1e-9


def test_routes_start_low_and_end_high() -> None:
    holds = _holds(None)
    for route in range(SMALL.routes):
        heights = [h.position[2] for h in holds if h.route == route]
        assert min(heights) < 1.5
        assert max(heights) > SMALL.height - 1.2
        assert len({h.colour for h in holds if h.route == route}) == 1
    assert {h.colour for h in holds if h.route == -2} == {"grey"}


def test_neighbouring_routes_differ_in_colour() -> None:
    colour = {h.route: h.colour for h in _holds(None) if h.route >= 0}
    for route in range(1, SMALL.routes):
        assert colour[route] != colour[route - 1]


def test_a_reset_keeps_wall_and_other_routes() -> None:
    before, after = set_up(SMALL, 4, None), set_up(SMALL, 4, Reset(9, "left"))
    for one, two in zip(before.wall, after.wall, strict=True):
        np.testing.assert_array_equal(one.corners, two.corners)
    old = {i.id: i for i in before.instances}
    kept = [i for i in after.instances if i.id in old and i.route == old[i.id].route]
    fresh = [i for i in after.instances if i.route >= SMALL.routes]
    assert fresh
    assert {i.route for i in kept if i.route >= 0}, "the right half stays"
    for item in kept:
        np.testing.assert_array_equal(item.position, old[item.id].position)
    assert np.mean([i.position[0] for i in fresh]) < SMALL.width / 2


def test_reset_of_an_unknown_part_is_refused() -> None:
    with pytest.raises(SettingsError, match="left"):
        Reset(1, "upstairs")


def test_settings_out_of_order_are_refused() -> None:
    with pytest.raises(SettingsError, match="holds_low"):
        replace(SMALL, holds_low=20)
    with pytest.raises(SettingsError, match="oldschool-dark"):
        gym_preset("oldschool")


def test_a_reset_keeps_light_and_paint() -> None:
    """Lamps hang by the wall alone, and a panel without holds is painted the same."""
    before, after = set_up(SMALL, 4, None), set_up(SMALL, 4, Reset(9, "all"))
    lamps = [hang_lamps(s.wall, SMALL, np.random.default_rng([4, 7])) for s in (before, after)]
    np.testing.assert_array_equal(lamps[0].centres, lamps[1].centres)
    assert [f.style for f in before.facets] == [f.style for f in after.facets]


def _volume_of(facets: list[Facet]) -> float:
    """Signed content of the body that the facets bound, cubic metres."""
    total = 0.0
    for corners in (facet.corners for facet in facets):
        for k in range(1, len(corners) - 1):
            total += float(np.linalg.det(corners[[0, k, k + 1]])) / 6
    return total


def test_round_volumes_are_closed_and_plane_facetted() -> None:
    built = set_up(replace(SMALL, round_volumes=1.0), 4)
    assert len(built.volumes) == SMALL.volumes
    assert all(volume.colour != "wood" for volume in built.volumes)
    for volume in built.volumes:
        facets = [facet for facet in built.facets if facet.instance == volume.id]
        assert {facet.kind for facet in facets} == {"dome"}
        edges = [
            (tuple(a.round(6)), tuple(b.round(6)))
            for facet in facets
            for a, b in zip(facet.corners, np.roll(facet.corners, -1, axis=0), strict=True)
        ]
        assert sorted(edges) == sorted((b, a) for a, b in edges), "every edge has its opposite"
        for facet in facets:
            spread = np.linalg.svd(facet.corners - facet.corners.mean(axis=0))[1]
            assert len(facet.corners) == 3 or spread[-1] < 1e-9
        assert _volume_of(facets) > 0.001
        corners = np.concatenate([facet.corners for facet in facets])
        assert ((corners - volume.position) @ volume.normal).max() > 0.05
    flat_ones = set_up(SMALL, 4)
    assert not any(facet.kind == "dome" for facet in flat_ones.facets)


def test_no_hold_hides_in_a_fin() -> None:
    finned = replace(SMALL, fins=2, width=7.0, columns=5)
    built = set_up(finned, 2)
    fins = [facet for facet in built.wall if facet.kind == "fin"]
    assert len(fins) == 4
    on_wall = [h for h in built.holds if not any(fin.carries(h.position) for fin in fins)]
    assert not behind_fins(fins, np.array([h.position for h in on_wall]), 0.05).any()
    assert len(on_wall) < len(built.holds), "fins carry holds too"


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("preset", PRESETS)
def test_presets_fit_on_a_small_wall(preset: str, seed: int) -> None:
    """Whatever the proportions, a wall gets built and set (possibly with fewer holds)."""
    settings_, _ = gym_preset(preset)
    rng = np.random.default_rng([seed, len(preset)])
    small = replace(
        settings_,
        width=float(rng.uniform(1.5, 4)),
        height=float(rng.uniform(1.5, 3)),
        columns=int(rng.integers(2, 5)),
        fins=int(rng.integers(0, 4)),
        routes=2,
        holds_low=3,
        holds_high=4,
        downclimb=1,
        detail=0.3,
    )
    built = set_up(small, seed)
    assert built.holds
    assert len({item.id for item in built.instances}) == len(built.instances)
