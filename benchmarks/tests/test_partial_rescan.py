"""A reset day on a generated wall: the left half is reset, photographed and scanned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.partial_rescan import Rescan, read_rescan

from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.scans.folder import ScanFolder

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def rescan(reset_day: Path) -> Rescan:
    return read_rescan(reset_day)


def test_what_was_not_photographed_is_exactly_as_before(rescan: Rescan) -> None:
    figures = rescan.figures
    assert len(figures.stays) >= 5
    assert rescan.changed() == []
    old, new = ScanFolder.mesh.load(rescan.old), ScanFolder.mesh.load(rescan.joined)
    table = ScanFolder.instances.load(rescan.joined).face_instance
    before = ScanFolder.instances.load(rescan.old).face_instance
    for number in figures.stays:
        corners = [
            mesh.vertices[mesh.faces[labels == number]]
            for mesh, labels in ((old, before), (new, table))
        ]
        assert np.array_equal(*corners)


def test_the_changed_half_is_found_as_well_as_before(rescan: Rescan) -> None:
    """Photos of 640 x 480 give a rough surface; docs/measure.md has the figures of larger ones."""
    figures = rescan.figures
    assert figures.seam_mm is not None
    assert figures.seam_mm < 20
    assert 0.25 < figures.replaced_share < 0.85
    assert figures.gone
    assert figures.added
    found = [sum(hits for _, hits, _ in rescan.found(after).values()) for after in (False, True)]
    assert found[1] >= 0.8 * found[0]


def test_the_joined_scan_is_the_reference_of_the_next_one(reset_day: Path, tmp_path: Path) -> None:
    folder = ScanFolder(reset_day / "joined")
    photos = sorted(folder.photos.glob("*.jpg"))[:6]
    words = ["sparse.threads=1", f"sparse.reference={str(folder.root)!r}"]
    next_one = scan(photos, tmp_path / "next", load_settings(None, words), to_stage="scale")
    scales = [ScanFolder.scale.load(one) for one in (folder, next_one.folder)]
    assert scales[0].reference_frame == scales[1].reference_frame
