"""Scans that start from given poses and from a ready mesh, on the tiny gym with its exact truth."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from written_poses import write_polycam  # type: ignore[import-not-found]

from walltopo.cli import main
from walltopo.core import Camera, InputError, Mesh, SettingsError, View
from walltopo.geometry.mesh_files import read_mesh, write_ply
from walltopo.geometry.similarity import Similarity, fit_poses
from walltopo.pipeline.settings import load_settings
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.poses import GivenPoses, PosesFit
from walltopo.scans.scale import Scale

TRUTH = Path(__file__).parents[2] / "data" / "tiny-gym-truth.npz"
# ARKit's frame: y up.
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def true_views() -> list[View]:
    """The exact cameras of the tiny gym, z up."""
    truth = np.load(TRUTH)
    fx, fy, cx, cy = truth["intrinsics"].tolist()
    width, height = truth["size"].tolist()
    camera = Camera("PINHOLE", width, height, (fx, fy, cx, cy))
    return [
        View(f"IMG_{k:04d}.jpg", camera, pose) for k, pose in enumerate(truth["cam_from_world"])
    ]


def in_arkit(view: View, shift: np.ndarray | None = None) -> View:
    rotation = view.cam_from_world[:, :3] @ Y_UP.T
    centre = Y_UP @ view.centre + (0 if shift is None else shift)
    return View(view.name, view.camera, np.column_stack([rotation, -rotation @ centre]))


def to_truth(scan: ScanFolder) -> tuple[Similarity, np.ndarray]:
    """The similarity from the scan's world to the truth, and the errors of the camera centres."""
    truth = {view.name: view for view in true_views()}
    views = read_views(scan.sparse)
    target = [truth[view.name] for view in views]
    fit = fit_poses(
        np.array([view.cam_from_world for view in views]),
        np.array([view.cam_from_world for view in target]),
    )
    pairs = zip(views, target, strict=True)
    return fit, np.array([np.linalg.norm(fit.apply(a.centre) - b.centre) for a, b in pairs])


QUICK = ("--set=sparse.threads=1", "--set=dense.edge_length=0.03", "--set=texture.size=2048")


@pytest.mark.slow
def test_a_phones_poses_and_a_ready_mesh_make_a_metric_upright_wall(
    tiny_photos: Path, tmp_path: Path
) -> None:
    export = tmp_path / "export"
    write_polycam(export, [in_arkit(view) for view in true_views()])
    truth = np.load(TRUTH)
    true_mesh = Mesh(truth["vertices"] @ Y_UP.T, truth["faces"])
    write_ply(export / "mesh.ply", true_mesh)
    given = ["scan", str(tiny_photos), "--poses", str(export), "-o", str(tmp_path / "scan")]
    given += ["--mesh", str(export / "mesh.ply"), "--to", "classify", *QUICK]
    assert main([*given, "--set", "scale.method=poses"]) == 0
    scan = ScanFolder(tmp_path / "scan")
    scale = Scale.load(scan.scale)
    assert (scale.method, scale.metric, scale.up_known, scale.plates) == ("poses", True, True, ())
    fit, errors = to_truth(scan)
    assert fit.scale == pytest.approx(1, abs=0.002)
    assert fit.rotation[2, 2] > np.cos(np.radians(0.1))
    assert len(errors) == 8
    assert errors.max() < 0.005
    # The mesh came through in the scan's frame.
    from scipy.spatial import cKDTree

    away, _ = cKDTree(read_mesh(scan.mesh).vertices).query(
        fit.inverse().apply(truth["vertices"][truth["faces"][truth["face_instance"] > 0]][:, 0])
    )
    assert np.median(away) < 0.004
    # Holds are where they are.
    corners = truth["vertices"][truth["faces"]].mean(axis=1)
    true_holds = np.array([corners[truth["face_instance"] == k].mean(axis=0) for k in range(1, 10)])
    found = [hold.position for hold in Holds.load(scan.holds_raw).holds]
    assert len(found) >= 7
    nearest, _ = cKDTree(true_holds).query(fit.apply(np.array(found)))
    assert (nearest < 0.1).sum() >= 6


@pytest.mark.slow
def test_drifting_poses_are_refined_and_photos_without_are_placed(
    tiny_photos: Path, tmp_path: Path
) -> None:
    export = tmp_path / "export"
    rng = np.random.default_rng(0)
    # 2 cm off; the last photo has no pose.
    views = [in_arkit(view, 0.02 * rng.standard_normal(3)) for view in true_views()[:-1]]
    write_polycam(export, views)
    given = ["scan", str(tiny_photos), "--poses", str(export), "-o", str(tmp_path / "scan")]
    given += ["--to", "scale", *QUICK]
    assert main([*given, "--set", "scale.method=poses"]) == 0
    scan = ScanFolder(tmp_path / "scan")
    _, errors = to_truth(scan)
    assert len(errors) == 8
    assert errors.max() < 0.005
    fit = PosesFit.load(scan.poses_fit)
    assert (fit.posed, fit.placed) == (7, 7)
    assert 0.005 < fit.median < 0.06
    # The plate on the floor counts more than the phone, and contradicts one that is 10 % off.
    for file in (export / "keyframes" / "corrected_cameras").iterdir():
        file.unlink()
    (export / "keyframes" / "corrected_cameras").rmdir()
    write_polycam(export, [_larger(in_arkit(view), 1.1) for view in true_views()])
    assert main(given) == 0
    scale = Scale.load(scan.scale)
    assert scale.method == "measure"
    assert scale.scale == pytest.approx(1 / 1.1, rel=0.02)
    assert any("by the plate, lengths differ by -" in note for note in scale.notes)


def _larger(view: View, factor: float) -> View:
    pose = view.cam_from_world.copy()
    pose[:, 3] *= factor
    return View(view.name, view.camera, pose)


@pytest.mark.slow
def test_poses_of_other_photos_are_refused(tiny_photos: Path, tmp_path: Path) -> None:
    views = [in_arkit(view) for view in true_views()]
    mixed = [views[k] for k in (3, 6, 0, 7, 1, 2, 5, 4)]
    named = [
        View(view.name, other.camera, other.cam_from_world)
        for view, other in zip(views, mixed, strict=True)
    ]
    write_polycam(tmp_path / "export", named)
    settings = load_settings(None, [f"sparse.poses={tmp_path / 'export'}", "sparse.threads=1"])
    from walltopo.pipeline.runner import scan

    with pytest.raises(InputError, match="do not fit the photos"):
        scan(tiny_photos, tmp_path / "scan", settings, to_stage="sparse")


def test_poses_are_kept_and_removed_with_the_setting(tiny_photos: Path, tmp_path: Path) -> None:
    from walltopo.pipeline.runner import scan

    export = tmp_path / "export"
    write_polycam(export, [in_arkit(view) for view in true_views()])
    out = ScanFolder(tmp_path / "scan")
    setting = [f"sparse.poses={export}"]
    wrong = load_settings(None, [f"sparse.poses={tmp_path / 'nothing'}"])
    with pytest.raises(InputError, match="no such file"):
        scan(tiny_photos, out.root, wrong, to_stage="ingest")
    scan(tiny_photos, out.root, load_settings(None, setting), to_stage="ingest")
    poses = GivenPoses.load(out.poses)
    assert (poses.app, poses.metric, poses.up, len(poses.photos)) == ("polycam", True, (0, 1, 0), 8)
    # The export was deleted: the scan goes on with what it has read.
    shutil.rmtree(export)
    scan([], out.root, load_settings(None, setting), to_stage="ingest")
    assert GivenPoses.load(out.poses) == poses
    scan([], out.root, load_settings(None), to_stage="ingest")
    assert not out.poses.exists()


def test_settings_that_contradict_are_refused() -> None:
    with pytest.raises(SettingsError, match="exclude each other"):
        load_settings(None, ["sparse.poses=a", "sparse.reference=b"])
    with pytest.raises(SettingsError, match=r"dense\.mesh needs sparse\.poses"):
        load_settings(None, ["dense.mesh=a.ply"])


def test_import_says_what_it_found(
    tiny_photos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_polycam(tmp_path, [in_arkit(view) for view in true_views()])
    shutil.copytree(tiny_photos, tmp_path / "keyframes" / "corrected_images")
    write_ply(tmp_path / "raw.ply", Mesh(np.eye(3), np.array([[0, 1, 2]], np.int32)))
    (tmp_path / "cloud.ply").write_text("ply\nelement face 0\nend_header\n")
    words = ["import", "auto", str(tmp_path)]
    assert main([*words, "--dry-run"]) == 0
    shown = capsys.readouterr().out
    for part in ("Polycam", "photos  8", "poses   8", "raw.ply (not used", "metres", "phone"):
        assert part in shown
    assert f"walltopo scan {tmp_path}/keyframes/corrected_images -o SCAN --poses" in shown
    assert main([*words, "--with-mesh", "--dry-run"]) == 0
    assert f"--mesh {tmp_path}/raw.ply" in capsys.readouterr().out
    assert main(words) == 2
    assert main(["import", "colmap", str(tmp_path), "--dry-run"]) == 3
    assert main(["import", "scaniverse", str(tmp_path), "--dry-run"]) == 3
    assert main(["import", "another", str(tmp_path), "--dry-run"]) == 2
    assert "not documented" in capsys.readouterr().err
