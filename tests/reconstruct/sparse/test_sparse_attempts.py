"""Photos that SIFT leaves out come in by the further attempts, at their right places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from half_size import chosen, put_photos, true_centres  # type: ignore[import-not-found]
from numpy.typing import NDArray

from walltopo.geometry.similarity import fit_similarity
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.sparse.attempts import agree
from walltopo.reconstruct.sparse.outcome import hang_together
from walltopo.reconstruct.sparse.settings import SparseSettings
from walltopo.scans.colmap_model import read_views

SPARSE = [0, 3, 6, 9, 21, 24]  # every third photo of two rows, at half size


@pytest.mark.slow
@pytest.mark.parametrize(("features", "means"), [("auto", "closer"), ("xfeat", "learned")])
def test_photos_far_apart_register(features: str, means: str, gym_a: Path, tmp_path: Path) -> None:
    scan = put_photos(tmp_path / "scan", chosen(gym_a, SPARSE), 474.0)
    settings = SparseSettings(features=features, threads=2)  # type: ignore[arg-type]
    metrics = run_stage(scan, "sparse", settings)
    assert metrics["means"] == means
    assert metrics["unregistered"] == {}
    found = np.array([view.centre for view in read_views(scan.sparse_raw)])
    truth = true_centres(gym_a, SPARSE)
    fit = fit_similarity(found, truth)
    away = np.linalg.norm(fit.apply(found) - truth, axis=1)
    assert away.max() < 0.05, "metres"


def test_sift_alone_leaves_them_out(gym_a: Path, tmp_path: Path) -> None:
    scan = put_photos(tmp_path / "scan", chosen(gym_a, SPARSE), 474.0)
    metrics = run_stage(scan, "sparse", SparseSettings(features="sift", threads=2))
    assert metrics["registered"] < len(SPARSE)
    assert len(metrics["unregistered"]) == len(SPARSE) - metrics["registered"]


def test_a_model_that_contradicts_the_one_before_is_told() -> None:
    rng = np.random.default_rng(0)
    known = {f"{k}.jpg": place for k, place in enumerate(rng.normal(size=(9, 3)))}
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = {name: 3 * turn @ place + 1 for name, place in known.items()}
    more = moved | {"new.jpg": np.zeros(3)}
    assert agree(known, more)
    folded = {name: at * [1, 1, -1] if at[0] > 0 else at for name, at in known.items()}
    assert not agree(known, folded)
    assert agree(known, {"other.jpg": np.zeros(3)}), "nothing in common: nothing is known"
    assert agree(dict.fromkeys(known, np.ones(3)), moved), "cameras in one place tell nothing"


def test_what_hangs_on_one_thing_is_not_tied() -> None:
    """Two rooms with the same printed measure, which everything else of both tells apart."""
    from walltopo.geometry.colmap import pycolmap

    def model(shared: NDArray[np.float64]) -> Any:
        made = pycolmap.Reconstruction()
        camera = pycolmap.Camera(
            model="PINHOLE", width=100, height=100, params=[90.0, 90.0, 50.0, 50.0], camera_id=1
        )
        made.add_camera_with_trivial_rig(camera)
        rng = np.random.default_rng(0)
        own = [rng.uniform(-1, 1, (80, 3)) for _ in "ab"]
        for number, name in ((1, "a.jpg"), (2, "b.jpg")):
            image = pycolmap.Image(
                name=name,
                keypoints=np.zeros((80 + len(shared), 2)),
                camera_id=1,
                image_id=number,
            )
            made.add_image_with_trivial_frame(image, pycolmap.Rigid3d())
        element = pycolmap.TrackElement
        for k, place in enumerate(shared):
            made.add_point3D(place, pycolmap.Track([element(1, 80 + k), element(2, 80 + k)]))
        for number, places in enumerate(own, start=1):
            for k, place in enumerate(places):
                made.add_point3D(place, pycolmap.Track([element(number, k)]))
        return made

    spots = np.random.default_rng(1).uniform(-1, 1, (40, 3))
    assert hang_together(model(spots), ["a.jpg"])
    assert not hang_together(model(0.1 * spots), ["a.jpg"]), "all in one place"
    assert not hang_together(model(spots[:5]), ["a.jpg"]), "too few"
    assert hang_together(model(spots[:5]), ["a.jpg", "b.jpg"]), "nothing new"
