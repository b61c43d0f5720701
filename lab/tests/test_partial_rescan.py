"""A reset day on a generated wall: the left half is reset, photographed and scanned."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.scans.folder import ScanFolder
from walltopo_lab.benchmarks.partial_rescan import Rescan, rescan_left_half
from walltopo_lab.synth.small import tiny_recipe

pytestmark = pytest.mark.slow

QUICK = ["sparse.threads=1", "texture.size=1024"]


@pytest.fixture(scope="module")
def reset_day(tmp_path_factory: pytest.TempPathFactory) -> Rescan:
    """A wall of 4 m, 24 photos of it, and about 12 of its left half after the reset."""
    small = tiny_recipe(24, (640, 480), seed=3)
    gym = replace(small.gym, width=4.0, columns=4, routes=5, volumes=2)
    return rescan_left_half(tmp_path_factory.mktemp("reset"), replace(small, gym=gym), QUICK)


def test_what_was_not_photographed_is_exactly_as_before(reset_day: Rescan) -> None:
    figures = reset_day.figures
    assert len(figures.stays) >= 5
    assert reset_day.changed() == []
    old, new = ScanFolder.mesh.load(reset_day.old), ScanFolder.mesh.load(reset_day.joined)
    table = ScanFolder.instances.load(reset_day.joined).face_instance
    before = ScanFolder.instances.load(reset_day.old).face_instance
    for number in figures.stays:
        corners = [
            mesh.vertices[mesh.faces[labels == number]]
            for mesh, labels in ((old, before), (new, table))
        ]
        assert np.array_equal(*corners)


def test_the_changed_half_is_found_as_well_as_before(reset_day: Rescan) -> None:
    """Photos of 640 x 480 give a rough surface; docs/measure.md has the figures of larger ones."""
    figures = reset_day.figures
    assert figures.seam_mm is not None
    assert figures.seam_mm < 20
    assert 0.25 < figures.replaced_share < 0.85
    assert figures.gone
    assert figures.added
    found = [sum(hits for _, hits, _ in reset_day.found(after).values()) for after in (False, True)]
    assert found[1] >= 0.8 * found[0]


def test_the_joined_scan_is_a_scan_of_its_own(reset_day: Rescan, tmp_path: Path) -> None:
    """It is edited and exported without its reference, and is the reference of the next rescan."""
    folder = reset_day.joined
    again = scan([], folder.root, load_settings(None, [*QUICK, "export.title=Mended"]))
    assert again.ran == ("export",)
    with pytest.raises(InputError, match="joined with its reference"):
        scan([], folder.root, load_settings(None, QUICK), from_stage="dense")
    others = folder.root.parent / "before/photos"
    with pytest.raises(InputError, match="photos cannot change"):
        scan(others, folder.root, load_settings(None, QUICK))
    photos = sorted(folder.photos.glob("*.jpg"))[:6]
    words = [*QUICK, f"sparse.reference={str(folder.root)!r}"]
    next_one = scan(photos, tmp_path / "next", load_settings(None, words), to_stage="scale")
    scales = [ScanFolder.scale.load(one) for one in (folder, next_one.folder)]
    assert scales[0].reference_frame == scales[1].reference_frame
