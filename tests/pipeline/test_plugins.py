"""A scan runs the detector and the dense backend of another package, by their names."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from walltopo.cli import main
from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.files import read_json
from walltopo.geometry.mesh_files import read_mesh
from walltopo.reconstruct.dense.backend import BACKENDS, open_backend
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.folder import ScanFolder
from walltopo.segment.detect.detector import open_detector
from walltopo.segment.settings import DetectSettings

MODULE = '''
"""A flat wall, and a detector that finds the middle of each photo."""

from dataclasses import dataclass

import numpy as np

from walltopo.core import Mask, Mesh
from walltopo.reconstruct.dense.backend import DenseInput
from walltopo.reconstruct.settings import DenseSettings
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.settings import DetectSettings


@dataclass(frozen=True)
class FlatWall:
    """A rectangle through the middle of the sparse points, facing the photos."""

    name: str
    settings: DenseSettings

    def check(self) -> None:
        pass

    def mesh(self, scan: DenseInput) -> Mesh:
        (x0, _, z0), (x1, _, z1) = np.percentile(scan.scene.points, [5, 95], axis=0)
        y = float(np.median(scan.scene.points[:, 1]))
        columns, rows = np.linspace(x0, x1, 20), np.linspace(z0, z1, 20)
        x, z = np.meshgrid(columns, rows)
        vertices = np.stack([x.ravel(), np.full(x.size, y), z.ravel()], axis=1)
        corner = (np.arange(19)[:, None] * 20 + np.arange(19)).ravel()
        lower = np.stack([corner, corner + 1, corner + 21], axis=1)
        upper = np.stack([corner, corner + 21, corner + 20], axis=1)
        scan.progress.note(f"{self.name}: {len(scan.photos.read_grey(scan.scene.views[0].name))}")
        return Mesh(vertices, np.concatenate([lower, upper]).astype(np.int32))


@dataclass(frozen=True)
class MiddleOfThePhoto:
    """One hold a photo: its middle."""

    name: str
    settings: DetectSettings

    classes = {1: "hold"}
    description = "toy"

    def detect(self, photo: np.ndarray) -> PhotoDetections:
        height, width = photo.shape[:2]
        pixels = np.zeros((height, width), bool)
        pixels[height // 4 : height // 2, width // 4 : width // 2] = True
        box = np.array([[width // 4, height // 4, width // 2, height // 2]], float)
        mask = Mask.from_full(pixels, label=1, score=0.9)
        return PhotoDetections(width, height, box, np.array([0.9]), np.array([1]), (mask,))
'''
ENTRY_POINTS = """
[walltopo.dense]
toy = walltopo_toys:FlatWall
broken = walltopo_toys:Gone

[walltopo.detectors]
toy = walltopo_toys:MiddleOfThePhoto
broken = package_that_is_not_there:Detector
"""


@pytest.fixture
def toys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with entry points, as pip leaves it in an environment."""
    site = tmp_path / "site"
    info = site / "walltopo_toys-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "walltopo_toys.py").write_text(MODULE, encoding="utf-8")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: walltopo-toys\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(site)
    return site


def test_a_scan_runs_the_backend_and_the_detector_of_another_package(
    toys: Path, tiny_photos: Path, tiny_scan: Path, tmp_path: Path
) -> None:
    out = tmp_path / "scan"
    shutil.copytree(tiny_scan, out)
    names = ["--dense", "toy", "--model", "toy"]
    small = ["--set", "sparse.threads=1", "--set", "texture.size=512"]
    assert main(["scan", str(tiny_photos), "-o", str(out), *names, *small, "--to", "detect"]) == 0
    folder = ScanFolder(out)
    stages = read_json(folder.manifest)["stages"]
    assert stages["dense"]["metrics"]["backend"] == "toy"
    mesh = read_mesh(folder.mesh)
    assert len(mesh.faces) == 2 * 19 * 19
    assert np.ptp(mesh.vertices[:, 1]) == 0.0
    found = read_json(folder.detections)
    assert [row["name"] for row in found["categories"]] == ["hold"]
    assert {row["image_id"] for row in found["annotations"]} == {
        row["id"] for row in found["images"]
    }
    assert {row["score"] for row in found["annotations"]} == {0.9}


def test_unknown_names_list_the_installed_ones(toys: Path) -> None:
    assert BACKENDS.names() == ("broken", "colmap", "openmvs", "sgm", "sparse", "toy")
    with pytest.raises(InputError, match="'magic' is not a known dense backend") as caught:
        open_backend("magic", DenseSettings())
    assert caught.value.hint.startswith(
        "Known dense backends: broken, colmap, openmvs, sgm, sparse, toy;"
    )
    with pytest.raises(InputError, match="'magic' is neither a known detector") as caught:
        open_detector(DetectSettings(model="magic"))
    assert caught.value.hint.startswith("Known detectors: broken, onnx, ")


def test_a_package_that_cannot_be_imported_is_named(toys: Path) -> None:
    for load in (
        lambda: open_backend("broken", DenseSettings()),
        lambda: open_detector(DetectSettings(model="broken")),
    ):
        with pytest.raises(EnvironmentLacksError, match="'broken' of walltopo-toys cannot be"):
            load()
