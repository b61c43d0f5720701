"""Fits and pose figures: exact recovery, and errors that are put in come out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from walltopo.core import Camera, InputError, View
from walltopo_lab.evaluate.align import align_views, fit_heading, pose_metrics

CAMERA = Camera("PINHOLE", 100, 80, (90.0, 90.0, 50.0, 40.0))


def view(name: str, centre: NDArray[np.float64], rotation: NDArray[np.float64]) -> View:
    return View(name, CAMERA, np.column_stack([rotation, -rotation @ centre]))


def views(seed: int = 0, count: int = 8) -> dict[str, View]:
    rng = np.random.default_rng(seed)
    turns = Rotation.random(count, rng=rng).as_matrix()
    return {f"{k}.jpg": view(f"{k}.jpg", rng.normal(size=3), turns[k]) for k in range(count)}


@given(angle=st.floats(-3.1, 3.1), seed=st.integers(0, 1000))
@settings(max_examples=50, deadline=None)
def test_heading_is_recovered_and_height_is_kept(angle: float, seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(5, 3))
    rotation = Rotation.from_euler("z", angle).as_matrix()
    fit = fit_heading(points, points @ rotation.T + [3.0, -2.0, 0.7])
    assert fit.apply(points)[:, :2] == pytest.approx((points @ rotation.T + [3.0, -2.0, 0])[:, :2])
    assert fit.apply(points)[:, 2] == pytest.approx(points[:, 2])


def test_pose_figures_show_what_was_put_in() -> None:
    truth = views()
    tilt = Rotation.from_euler("x", 1.0, degrees=True).as_matrix()
    scan = {
        name: view(name, 1.01 * tilt @ v.centre, v.cam_from_world[:, :3] @ tilt.T)
        for name, v in truth.items()
    }
    figures = pose_metrics(scan, truth, similarity=True)
    assert figures["centre_max_mm"] == pytest.approx(0, abs=1e-6)
    assert figures["rotation_max_deg"] == pytest.approx(0, abs=1e-4)
    assert figures["scale_error_percent"] == pytest.approx(1.0)
    assert figures["up_error_deg"] == pytest.approx(1.0)
    assert pose_metrics(scan, truth, similarity=False)["centre_median_mm"] > 5


def test_few_photos_in_common_are_refused() -> None:
    truth = views()
    with pytest.raises(InputError, match="common"):
        align_views({k: truth[k] for k in ("0.jpg", "1.jpg")}, truth, similarity=True)
