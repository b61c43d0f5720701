"""Types of holds by shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from walltopo.routes.geometry import Shape
from walltopo.routes.hold_type import measures, shipped_model

MIDDLING = Shape(
    position=np.zeros(3),
    normal=np.array([0.0, -1, 0]),
    size_m=0.13,
    width_m=0.055,
    protrusion_m=0.035,
    incut=0.0,
    upright=-1.0,
    hollow=0.7,
    ledge=0.1,
    faces_up=0.2,
    area_m2=0.01,
    steepness_deg=0.0,
)


def test_the_mean_shape_of_each_type_is_named_so() -> None:
    model = shipped_model()
    assert set(model.names) == {"jug", "crimp", "sloper", "pinch", "pocket", "foothold"}
    for name, mean in zip(model.names, model.means, strict=True):
        found, sure = model.name(mean)
        assert found == name
        assert sure > 0.9


def test_an_unheard_of_shape_is_unknown() -> None:
    huge = replace(MIDDLING, size_m=3.0, width_m=2.5, protrusion_m=2.0)
    assert shipped_model().name(measures(huge, 1.0))[0] == "unknown"


def test_a_tie_is_unknown() -> None:
    model = shipped_model()
    flat = replace(model, certain=0.999999)
    between = (model.means[0] + model.means[4]) / 2
    assert flat.name(between)[0] == "unknown"


@pytest.mark.parametrize("factor", [0.01, 1.0, 40.0])
def test_measures_do_not_depend_on_the_unit(factor: float) -> None:
    scaled = replace(
        MIDDLING,
        size_m=factor * MIDDLING.size_m,
        width_m=factor * MIDDLING.width_m,
        protrusion_m=factor * MIDDLING.protrusion_m,
    )
    np.testing.assert_allclose(measures(scaled, factor), measures(MIDDLING, 1.0))
