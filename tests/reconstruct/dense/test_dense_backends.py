"""Backends: which is picked, their errors when they cannot run, OpenMVS's arguments."""

from __future__ import annotations

import argparse
import json
from contextlib import nullcontext
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from walltopo.cli import mesh as mesh_cli
from walltopo.core import EnvironmentLacksError, InputError, Mesh, SettingsError, Silent, StageError
from walltopo.geometry.mesh_files import write_ply
from walltopo.geometry.subdivision import drop_long_triangles, split_long_edges
from walltopo.geometry.topology import edges_of
from walltopo.pipeline.stages.dense import DENSE
from walltopo.reconstruct.dense import colmap
from walltopo.reconstruct.dense.backend import DenseInput, open_backend
from walltopo.reconstruct.dense.colmap import colmap_mesh, cuda_devices, has_cuda
from walltopo.reconstruct.dense.make_mesh import pick_backend
from walltopo.reconstruct.dense.openmvs import densify_arguments, mesh_arguments, refine_arguments
from walltopo.reconstruct.dense.scene import Scene
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.photos import PhotoSet


def test_argument_lists_chain_absolute_files() -> None:
    scene, dense, mesh, refined = (Path("/w") / n for n in ("s.mvs", "d.mvs", "m.ply", "r.ply"))
    steps = [
        densify_arguments(scene, dense, 1600),
        mesh_arguments(dense, mesh, edge=0.008, pixel=0.004),
        refine_arguments(dense, mesh, refined),
    ]
    files = [{a: b for a, b in pairwise(step) if a in ("-i", "-p", "-m", "-o")} for step in steps]
    assert files == [
        {"-i": "/w/s.mvs", "-o": "/w/d.mvs"},
        {"-i": "/w/d.mvs", "-p": "/w/d.ply", "-o": "/w/m.ply"},
        {"-i": "/w/d.mvs", "-m": "/w/m.ply", "-o": "/w/r.ply"},
    ]
    assert steps[0][steps[0].index("--max-resolution") + 1] == "1600"
    assert steps[1][steps[1].index("--min-point-distance") + 1] == "1.400"


def test_split_long_edges_keeps_surface_and_topology() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.3]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], dtype=np.int32)
    mesh = split_long_edges(Mesh(corners, faces), 0.2)
    edges = edges_of(mesh.faces)
    assert (edges.count == 2).all()
    assert len(mesh.vertices) - len(edges.pairs) + len(mesh.faces) == 2
    ends = mesh.vertices[edges.pairs]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() <= 0.2
    assert mesh.areas.sum() == pytest.approx(Mesh(corners, faces).areas.sum())
    vectors = mesh.normals * mesh.areas[:, None]
    assert np.allclose(vectors.sum(axis=0), 0.0)


def test_wide_triangles_go() -> None:
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [2, 2, 0]], dtype=float)
    mesh = Mesh(corners, np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32))
    assert drop_long_triangles(mesh, 0.2).faces.tolist() == [[0, 1, 2]]


def test_cuda_needs_a_device() -> None:
    listed = Path("/proc/driver/nvidia/gpus")
    devices = len(list(listed.iterdir())) if listed.is_dir() else 0
    assert (cuda_devices() > 0) == (devices > 0)
    assert not has_cuda() or devices


@pytest.mark.skipif(has_cuda(), reason="CUDA and a device are here")
def test_colmap_without_cuda_is_refused(tmp_path: Path) -> None:
    with pytest.raises(EnvironmentLacksError, match="CUDA"):
        colmap_mesh(tmp_path, tmp_path, tmp_path, DenseSettings(), 0.01, 1.0, Silent())


@pytest.mark.skipif(has_cuda(), reason="CUDA and a device are here")
def test_auto_without_cuda_is_sgm() -> None:
    assert pick_backend(DenseSettings())[0] == "sgm"


def test_a_backend_requested_is_not_replaced() -> None:
    assert pick_backend(DenseSettings(backend="sparse")) == ("sparse", "as asked")


def test_an_unknown_backend_is_refused_before_the_first_stage() -> None:
    with pytest.raises(InputError, match="'magic' is not a known dense backend") as caught:
        DENSE.check(DenseSettings(backend="magic"))
    assert caught.value.hint == "Known dense backends: colmap, openmvs, sgm, sparse; or auto."


@pytest.mark.skipif(has_cuda(), reason="CUDA and a device are here")
def test_backends_say_what_they_lack() -> None:
    with pytest.raises(EnvironmentLacksError, match="CUDA"):
        open_backend("colmap", DenseSettings()).check()
    with pytest.raises(EnvironmentLacksError, match="InterfaceCOLMAP"):
        open_backend("openmvs", DenseSettings(openmvs_bin="/nowhere")).check()
    for name in ("sgm", "sparse"):
        open_backend(name, DenseSettings()).check()


@pytest.mark.parametrize("fails", [False, True])
def test_another_program_gets_the_scan_and_its_logs_stay_after_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: bool
) -> None:
    """COLMAP itself needs CUDA: this looks at what it would be given."""
    given: list[object] = []
    made = Mesh(np.eye(3), np.array([[0, 1, 2]], dtype=np.int32))

    def compute(*arguments: object) -> Mesh:
        given.extend(arguments)
        if fails:
            raise StageError("no points")
        return made

    monkeypatch.setattr(colmap, "colmap_mesh", compute)
    settings, progress = DenseSettings(backend="colmap"), Silent()
    photos, sparse = PhotoSet(tmp_path / "photos"), SparseModel(tmp_path / "sparse")
    scene = Scene((), np.zeros((0, 3)), ())
    scan = DenseInput(photos, sparse, scene, 0.008, 1.0, tmp_path, progress)
    with pytest.raises(StageError) if fails else nullcontext():
        assert open_backend("colmap", settings).mesh(scan) is made
    work = given.pop(2)
    assert given == [sparse.folder, photos.folder, settings, 0.008, 1.0, progress]
    assert isinstance(work, Path)
    assert work.parent == tmp_path
    assert work.name.startswith("colmap-")
    assert work.exists() == fails


def test_settings_are_bounded() -> None:
    with pytest.raises(SettingsError, match=r"dense\.edge_length: expected at least"):
        DenseSettings(edge_length=0.0)


def check(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser()
    mesh_cli.register(parser.add_subparsers())
    args = parser.parse_args(["mesh", "check", *arguments])
    return int(args.run(args))


def test_mesh_check_tells_good_from_bad(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    good = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], dtype=np.int32)
    write_ply(tmp_path / "good.ply", Mesh(corners, good))
    bad = np.concatenate([good, [[0, 1, 2], [0, 1, 2]]]).astype(np.int32)
    write_ply(tmp_path / "bad.ply", Mesh(corners, bad))
    assert check([str(tmp_path / "good.ply")]) == 0
    assert check([str(tmp_path / "bad.ply")]) == 1
    assert "not manifold" in capsys.readouterr().out
    assert check([str(tmp_path / "good.ply"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["faces"] == 4
