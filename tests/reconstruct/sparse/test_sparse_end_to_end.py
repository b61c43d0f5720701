"""Photos of the rendered gym, reduced, through sparse and scale; an update into the result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from half_size import chosen, put_photos, true_centres  # type: ignore[import-not-found]
from numpy.typing import NDArray
from PIL import Image

from walltopo.core import InputError, Silent, StageError
from walltopo.core.files import hash_path
from walltopo.pipeline.runner import run_stage
from walltopo.reconstruct.settings import ScaleSettings, SparseSettings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.scale import Aligned, Frame, Scale

Floats = NDArray[np.float64]
SETTINGS: dict[str, Any] = {"first_octave": -1, "max_features": 4000, "threads": 2}
GYM = [0, 1, 2, 3, 20, 21, 22, 23, 36, 37, 60, 61, 62]
RESET = [0, 1, 2, 9, 10, 11]


def centres(scan: ScanFolder) -> Floats:
    return np.array([view.centre for view in read_views(scan.sparse)])


@pytest.fixture(scope="module")
def reference(gym_a: Path, tmp_path_factory: pytest.TempPathFactory) -> ScanFolder:
    scan = put_photos(tmp_path_factory.mktemp("gym") / "scan", chosen(gym_a, GYM), 499.0)
    metrics = run_stage(scan, "sparse", SparseSettings(**SETTINGS))
    assert metrics["registered"] == len(GYM)
    assert metrics["unregistered"] == {}
    assert run_stage(scan, "scale", ScaleSettings())["method"] == "measure"
    return scan


def test_the_scan_is_metric_upright_and_on_the_floor(reference: ScanFolder, gym_a: Path) -> None:
    found, truth = centres(reference), true_centres(gym_a, GYM)
    assert np.abs(found[:, 2] - truth[:, 2]).max() < 0.015
    apart = np.linalg.norm(found[:, None] - found[None], axis=2)
    real = np.linalg.norm(truth[:, None] - truth[None], axis=2)
    assert abs(apart.sum() / real.sum() - 1) < 0.004
    record = Scale.load(reference.scale)
    assert record.frame == Frame(metric=True, up_known=True, floor_known=True)
    assert [plate.ids for plate in record.plates] == [(0, 1, 2, 3)]
    # The world's origin lies below the middle of this plate, 4 mm of board, x along its top edge.
    sheet = [[-0.21, 0.21, 0.004], [0.21, 0.21, 0.004], [0.21, -0.21, 0.004], [-0.21, -0.21, 0.004]]
    assert np.allclose(record.plates[0].corners, sheet, atol=0.002)


def test_a_second_run_reuses_features_and_is_the_same(reference: ScanFolder) -> None:
    before = hash_path(reference.sparse_raw)
    frame = Scale.load(reference.scale).frame
    Aligned(reference="old", align="rigid", reference_moved=0.0, shared_points=1, frame=frame).save(
        reference.aligned
    )

    class Steps(Silent):
        seen: list[str] = []  # noqa: RUF012

        def step(self, what: str, total: int | None = None) -> None:
            self.seen.append(what)

    run_stage(reference, "sparse", SparseSettings(**SETTINGS), Steps())
    assert hash_path(reference.sparse_raw) == before
    assert not reference.aligned.exists(), "a scan that is no update any more"
    assert Steps.seen == ["register photos", "refine the model"]


@pytest.mark.slow
def test_an_update_lands_in_the_frame_of_its_reference(
    reference: ScanFolder, data_root: Path, gym_a: Path, tmp_path: Path
) -> None:
    folder = data_root / "gym-a-reset"
    before = hash_path(reference.root)
    new = put_photos(tmp_path / "new", chosen(folder, RESET), 499.0)
    # Distances across the two scans need no common frame with the truth.
    truth = true_centres(folder, RESET)[:, None] - true_centres(gym_a, GYM)[None]
    for align in ("constrained", "rigid"):
        settings = {**SETTINGS, "reference": str(reference.root), "align": align}
        metrics = run_stage(new, "sparse", SparseSettings(**settings))
        assert metrics["registered"] == len(RESET)
        assert metrics["reference_moved"] <= 1e-9
        aligned = Aligned.load(new.aligned)
        assert (aligned.reference, aligned.align) == (str(reference.root), align)
        assert aligned.frame == Scale.load(reference.scale).frame
        assert run_stage(new, "scale", ScaleSettings())["method"] == "reference"
        assert hash_path(reference.root) == before
        names = [view.name for view in read_views(new.sparse)]
        assert names == [path.name for path in chosen(folder, RESET)]
        across = np.linalg.norm(centres(new)[:, None] - centres(reference)[None], axis=2)
        assert np.median(np.abs(across - np.linalg.norm(truth, axis=2))) < 0.01


@pytest.mark.slow
def test_photos_of_another_wall_are_refused(
    reference: ScanFolder, data_root: Path, tmp_path: Path
) -> None:
    before = hash_path(reference.root)
    files = sorted((data_root / "spraywall" / "photos").iterdir())[:3]
    new = put_photos(tmp_path / "new", files, None)
    settings: dict[str, Any] = {**SETTINGS, "reference": str(reference.root)}
    with pytest.raises(StageError, match="another wall"):
        run_stage(new, "sparse", SparseSettings(**settings))
    assert hash_path(reference.root) == before
    assert not new.sparse_raw.exists()


def test_a_reference_without_cameras_or_of_itself_is_refused(
    reference: ScanFolder, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    for path, output in (
        (tmp_path / "empty", "cameras"),
        (tmp_path / "nowhere", "no such"),
        (reference.root, "own"),
    ):
        with pytest.raises(InputError, match=output):
            run_stage(reference, "sparse", SparseSettings(reference=str(path)))


@pytest.mark.slow
def test_photos_that_share_nothing_are_reported(tmp_path: Path) -> None:
    files = []
    for k in range(3):
        noise = np.random.default_rng(k).integers(0, 256, (480, 640, 3)).astype(np.uint8)
        files.append(tmp_path / f"{k}.png")
        Image.fromarray(noise).save(files[-1])
    scan = put_photos(tmp_path / "scan", files, None)
    with pytest.raises(StageError, match="none of the 3"):
        run_stage(scan, "sparse", SparseSettings(**SETTINGS))
