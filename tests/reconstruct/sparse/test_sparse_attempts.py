"""Photos that SIFT leaves out come in by the further attempts, at their right places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from half_size import chosen, put_photos, true_centres  # type: ignore[import-not-found]

from walltopo.geometry.similarity import fit_similarity
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.colmap_model import read_views

SPARSE = [0, 3, 6, 9, 21, 24]  # every third photo of two rows, at half size
MORE = [0, 3, 6, 9, 12, 15, 21, 24, 27, 30]  # enough for doubled photos to be tried first


@pytest.mark.slow
@pytest.mark.parametrize(("photos", "means"), [(SPARSE, "learned"), (MORE, "closer")])
def test_photos_far_apart_register(
    photos: list[int], means: str, gym_a: Path, tmp_path: Path
) -> None:
    scan = put_photos(tmp_path / "scan", chosen(gym_a, photos), 474.0)
    metrics = run_stage(scan, "sparse", SparseSettings(threads=2))
    assert metrics["means"] == means
    assert metrics["unregistered"] == {}
    found = np.array([view.centre for view in read_views(scan.sparse_raw)])
    truth = true_centres(gym_a, photos)
    fit = fit_similarity(found, truth)
    away = np.linalg.norm(fit.apply(found) - truth, axis=1)
    assert away.max() < 0.05, "metres"


def test_sift_alone_leaves_them_out(gym_a: Path, tmp_path: Path) -> None:
    scan = put_photos(tmp_path / "scan", chosen(gym_a, SPARSE), 474.0)
    metrics = run_stage(scan, "sparse", SparseSettings(features="sift", threads=2))
    assert metrics["registered"] < len(SPARSE)
    assert len(metrics["unregistered"]) == len(SPARSE) - metrics["registered"]
