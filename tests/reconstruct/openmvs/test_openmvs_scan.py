"""OpenMVS itself, where it is installed: a relative scan folder, from photos to the texture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from walltopo.cli import main
from walltopo.core import Silent
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.mesh_files import read_mesh
from walltopo.images.files import read_rgb
from walltopo.reconstruct.settings import TextureSettings
from walltopo.reconstruct.texture.atlas import make_texture
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.pictures import TextureUv

EDGE = 0.03


@pytest.fixture(scope="module")
def scan(openmvs: Path, tiny_photos: Path, tmp_path_factory: pytest.TempPathFactory) -> ScanFolder:
    """The tiny gym, meshed and textured by OpenMVS in a scan folder named relatively."""
    root = tmp_path_factory.mktemp("openmvs-scan")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(root)
        settings = {
            "dense.backend": "openmvs",
            "dense.openmvs_bin": openmvs,
            "dense.openmvs_refine": "true",
            "dense.edge_length": EDGE,
            "dense.max_size": 320,
            "texture.backend": "openmvs",
            "texture.openmvs_bin": openmvs,
            "texture.size": 1024,
        }
        given = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
        assert main(["scan", str(tiny_photos), "-o", "scan", "--to", "texture", *given]) == 0
    return ScanFolder(root / "scan")


@pytest.mark.slow
def test_the_mesh_is_what_later_stages_trust(scan: ScanFolder) -> None:
    report = check_mesh(read_mesh(scan.mesh))
    assert not report.defects
    assert 0.7 * EDGE < report.edge_length_median < 1.3 * EDGE
    # The wall has 2.4 x 2.2 m and mats before it.
    assert report.area > 5.0


@pytest.mark.slow
def test_the_texture_lies_on_the_meshs_own_triangles(scan: ScanFolder) -> None:
    mesh = read_mesh(scan.mesh)
    uv = TextureUv.load(scan.texture_uv)
    uv.check_fits(mesh)
    assert uv.uv.min() >= 0.0
    assert uv.uv.max() <= 1.0
    atlas = read_rgb(scan.texture)
    assert max(atlas.shape) <= 1024
    own = make_texture(
        mesh,
        read_views(scan.sparse),
        lambda name: read_rgb(scan.photos / name),
        TextureSettings(size=1024),
        Silent(),
    )
    seen = own.label >= 0
    theirs, ours = colours(atlas, uv.uv)[seen], colours(own.image, own.uv)[seen]
    assert np.median(np.abs(theirs - ours)) < 12.0
    # Neighbours in the file are neighbours on the wall, so a shift by some is no strong proof;
    # the order reversed must fit clearly worse.
    assert np.median(np.abs(theirs[::-1] - ours)) > 2.0 * np.median(np.abs(theirs - ours))


def colours(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(F, 3) colour in the middle of each triangle."""
    at = (uv.mean(axis=1) * (image.shape[1], image.shape[0])).astype(int)
    return image[at[:, 1], at[:, 0]].astype(float)
