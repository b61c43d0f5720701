"""The larger network: the last attempt, if its package is installed."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse import attempts
from walltopo.reconstruct.sparse.jobs import CameraEntry, ColmapJob, ImageEntry, KnownFeatures, Sift
from walltopo.reconstruct.sparse.larger_network import Aliked, larger_network_files

NO_FILES: tuple[Path, Path] | None = None
FILES = Path("aliked.onnx"), Path("lightglue.onnx")


def job(photos: int) -> ColmapJob:
    return ColmapJob(
        database="work/features/features.db",
        image_root="photos",
        threads=1,
        seed=0,
        sift=Sift(100, 0),
        min_matches=15,
        cameras=(CameraEntry("SIMPLE_RADIAL", 40, 30, (40.0, 20.0, 15.0, 0.0), False),),
        images=tuple(ImageEntry(f"{k}.jpg", 0) for k in range(photos)),
    )


@pytest.mark.parametrize(
    ("files", "features", "strategies"),
    [
        (FILES, "auto", ["closer", "learned", "larger"]),
        (NO_FILES, "auto", ["closer", "learned"]),
        (FILES, "sift", []),
    ],
)
def test_the_larger_network_is_the_last_strategy(
    files: tuple[Path, Path] | None,
    features: str,
    strategies: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(attempts, "larger_network_files", lambda: files)
    settings = SparseSettings(features=features)  # type: ignore[arg-type]
    assert [name for name, _ in attempts.further_strategies(settings, 17)] == strategies


def test_its_job_keeps_all_features_so_far() -> None:
    made = attempts.larger_job(job(5), {"1.jpg", "3.jpg"})
    assert made.learned is not None
    assert made.learned.larger
    assert made.learned.images == (2, 4)
    assert Path(made.database) == Path("work/features.larger/features.db")
    names = {f"{k}.jpg": f"{k}.jpg" for k in range(5)}
    assert made.known_features == KnownFeatures("work/features/features.db", names, matches=True)


def shapes() -> NDArray[np.uint8]:
    rng = np.random.default_rng(2)
    picture = np.full((320, 448, 3), 170, np.uint8)
    for _ in range(160):
        corners = rng.integers(0, 320, 2) + rng.integers(0, 60, (4, 2))
        cv2.fillConvexPoly(
            picture, cv2.convexHull(corners.astype(np.int32)), rng.integers(0, 255, 3).tolist()
        )
    return picture


def test_matches_follow_the_picture() -> None:
    files = larger_network_files()
    if files is None:
        pytest.skip("walltopo-features is not installed")
    network, picture = Aliked(*files, threads=1), shapes()
    turn = np.array([[0.95, -0.12, 30.0], [0.12, 0.95, -20.0]])
    moved = cv2.warpAffine(picture, turn, (448, 320), borderValue=(170, 170, 170))
    a, b = network.find(picture, 500), network.find(moved.astype(np.uint8), 500)
    assert np.allclose(np.linalg.norm(a.descriptors, axis=1), 1, atol=1e-3)
    matches = network.match(a, b)
    assert len(matches) > 150
    # Pixel centres: COLMAP's are half a pixel off OpenCV's.
    there = (a.xy[matches[:, 0]] - 0.5) @ turn[:, :2].T + turn[:, 2] + 0.5
    away = np.linalg.norm(there - b.xy[matches[:, 1]], axis=1)
    assert np.median(away) < 1
    assert (away < 5).mean() > 0.95
    plain = network.find(np.full((96, 128, 3), 128, np.uint8), 300)
    assert network.match(plain, a).shape[1] == 2
