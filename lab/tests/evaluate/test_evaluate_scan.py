"""A scan against truth: a tiny wall, exact, shifted, cut and mislabelled; and the real format."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.geometry.mesh_files import read_mesh, write_ply
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.routes import Route, Routes
from walltopo.scans.scale import Scale
from walltopo_lab.cli import evaluate as commands
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.errors_mesh import Outcome, coloured_mesh, outcome_of_faces
from walltopo_lab.evaluate.instances import summarise_instances
from walltopo_lab.evaluate.operating import at_score, operating_point
from walltopo_lab.evaluate.overlap import Labelled, overlap_of_faces
from walltopo_lab.evaluate.routes import match_pairs, route_metrics
from walltopo_lab.evaluate.scan import evaluate_scan
from walltopo_lab.evaluate.semantics import class_of_faces, confusion, semantic_metrics
from walltopo_lab.evaluate.truth import TrueInstance, Truth, read_truth


def grid(n: int, size: float = 1.0) -> Mesh:
    """A vertical wall of n x n squares in the plane y = 0, its foot 1 m over the floor."""
    x, z = np.meshgrid(np.linspace(0, size, n + 1), np.linspace(0, size, n + 1))
    vertices = np.stack([x.ravel(), np.zeros(x.size), 1 + z.ravel()], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + 1, corner + n + 2, corner + n + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Mesh(vertices, faces.astype(np.int32))


def in_box(mesh: Mesh, x0: float, x1: float, z0: float, z1: float) -> NDArray[np.bool_]:
    x, _, z = mesh.centroids.T
    return (x > x0) & (x < x1) & (z > 1 + z0) & (z < 1 + z1)


def labels_on(mesh: Mesh) -> NDArray[np.int32]:
    """Two holds and a volume."""
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    face_instance[in_box(mesh, 0.1, 0.3, 0.1, 0.3)] = 1
    face_instance[in_box(mesh, 0.6, 0.8, 0.1, 0.3)] = 2
    face_instance[in_box(mesh, 0.3, 0.7, 0.6, 0.9)] = 3
    return face_instance


def instance(number: int, route: int, label: int = 1) -> TrueInstance:
    return TrueInstance(number, label, "jug", "red", route, (0, 0, 0), (0, 1, 0), ("red",))


TRUE = {1: instance(1, 0), 2: instance(2, 1), 3: instance(3, -1, 2)}


@pytest.fixture
def truth() -> Truth:
    mesh = grid(40)
    return Truth(mesh, labels_on(mesh), np.full(len(mesh.faces), 5, np.int32), TRUE)


def test_labels_cross_between_meshings(truth: Truth) -> None:
    other = grid(60)
    carried = carry_truth(truth, other, 0.02)
    agree = other.areas[carried.labelled.face_instance == labels_on(other)].sum()
    assert agree > 0.99
    assert not carried.ignored.any()
    assert carried.distance.max() < 1e-9


def test_far_surface_carries_nothing(truth: Truth) -> None:
    other = grid(40)
    lifted = Mesh(other.vertices + np.array([0, 0.05, 0]), other.faces)
    carried = carry_truth(truth, lifted, 0.02, reach=0.2)
    assert not carried.labelled.face_instance.any()
    assert carried.distance == pytest.approx(0.05)


def test_unseen_surface_is_ignored_where_no_seen_one_is_near(truth: Truth) -> None:
    views = truth.face_views.copy()
    views[in_box(truth.mesh, 0.5, 1.0, 0.0, 1.0)] = 0
    half = Truth(truth.mesh, truth.face_instance, views, TRUE)
    carried = carry_truth(half, grid(60), 0.02)
    middle = grid(60).centroids[carried.ignored][:, 0].min()
    assert 0.5 < middle < 0.54


def test_instances_that_were_not_reconstructed_are_missed(truth: Truth) -> None:
    whole = grid(60)
    left = Mesh(whole.vertices, whole.faces[whole.centroids[:, 0] < 0.5])
    predicted = Labelled(labels_on(left), {1: 1, 2: 1, 3: 2})
    carried = carry_truth(truth, left, 0.02)
    overlap = overlap_with_missing(predicted, carried, left.areas, truth)
    assert summarise_instances([overlap]).agnostic.truth == 3
    assert summarise_instances([overlap]).agnostic.ap50 < 1
    assert match_pairs(overlap) == {1: 1, 3: 3}


def test_outcomes_of_faces() -> None:
    predicted = np.array([1, 1, 0, 2, 0, 0, 1, 0], np.int32)
    true = np.array([7, 0, 7, 0, 8, 0, 8, 9], np.int32)
    ignored = np.array([0, 0, 0, 0, 0, 0, 0, 1], np.bool_)
    outcome = outcome_of_faces(predicted, true, {1: 7}, ignored)
    assert outcome.tolist() == [
        Outcome.HIT,
        Outcome.BORDER,
        Outcome.BORDER,
        Outcome.FALSE,
        Outcome.MISSED,
        Outcome.WALL,
        Outcome.MISSED,
        Outcome.IGNORED,
    ]


def test_coloured_mesh_splits_vertices_at_borders_only() -> None:
    mesh = grid(10)
    outcomes = np.where(in_box(mesh, 0, 0.5, 0, 1), int(Outcome.HIT), int(Outcome.WALL))
    coloured = coloured_mesh(mesh, outcomes)
    assert len(coloured.vertices) == len(mesh.vertices) + 11
    assert coloured.centroids == pytest.approx(mesh.centroids)


def test_miou_by_hand() -> None:
    truth = Labelled(np.array([0, 1, 1, 2], np.int32), {1: 1, 2: 2})
    predicted = Labelled(np.array([0, 0, 5, 5], np.int32), {5: 1})
    areas = np.array([4.0, 1.0, 2.0, 3.0])
    table = confusion(class_of_faces(predicted), class_of_faces(truth), areas, 3)
    metrics = semantic_metrics([table])
    assert metrics.iou == pytest.approx({0: 4 / 5, 1: 2 / 6, 2: 0})
    assert metrics.miou == pytest.approx((4 / 5 + 1 / 3) / 3)
    assert metrics.miou_objects == pytest.approx(1 / 6)


def test_routes_leave_out_volumes_and_unmatched() -> None:
    true = {k: instance(k, r) for k, r in enumerate([0, 0, 1, 1, -1, -2], start=1)}
    pairs = {10 * k: k for k in true}
    routes = [Route(1, holds=(10, 20, 50)), Route(2, holds=(30, 40))]
    figures = route_metrics(routes, pairs, true)
    assert (figures["ari"], figures["holds_compared"]) == (1.0, 4)
    assert (figures["downclimb_holds"], figures["downclimb_kept_out"]) == (1, 1)
    one = route_metrics([Route(1, holds=(10, 20, 30, 40))], pairs, true)
    assert (one["ari"], one["completeness"], one["homogeneity"]) == (0.0, 1.0, 0.0)
    none = route_metrics([], pairs, true)
    assert none["holds_unrouted"] == 4
    assert none["homogeneity"] == pytest.approx(1.0)  # each hold alone


def run_command(*words: str) -> int:
    parser = argparse.ArgumentParser()
    commands.register(parser.add_subparsers())
    args = parser.parse_args(words)
    return int(args.run(args))


def write_truth(folder: Path, truth: Truth, **more: Any) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, Any] = {
        "vertices": truth.mesh.vertices,
        "faces": truth.mesh.faces,
        "face_instance": truth.face_instance,
        "face_views": truth.face_views,
        **more,
    }
    np.savez(folder / "gt.npz", **arrays)
    rows = [
        {
            "id": row.id,
            "class": {1: "hold", 2: "volume"}[row.label],
            "kind": row.kind,
            "colour": row.colour,
            "route": row.route,
            "position": row.position,
            "normal": row.normal,
        }
        for row in TRUE.values()
    ]
    (folder / "scene.json").write_text(json.dumps({"instances": rows}))


def test_truth_is_read_back_and_faults_are_named(tmp_path: Path, truth: Truth) -> None:
    write_truth(tmp_path / "gym/truth", truth)
    again = read_truth(tmp_path / "gym")
    assert (again.face_instance == truth.face_instance).all()
    assert again.instances[3].label == 2
    with pytest.raises(InputError, match="truth"):
        read_truth(tmp_path)
    np.savez(tmp_path / "gt.npz", vertices=truth.mesh.vertices)
    with pytest.raises(InputError, match="face_instance"):
        read_truth(tmp_path)


def records(instances: Mapping[int, TrueInstance], *more: InstanceRecord) -> InstanceRecords:
    """Return what the lift would say of these."""
    classes = {1: "hold", 2: "volume"}
    rows = [
        InstanceRecord(k, one.label, classes[one.label], 0.9, {str(one.label): 1.0}, (), 1)
        for k, one in instances.items()
    ]
    return InstanceRecords(classes={"1": "hold", "2": "volume"}, instances=(*rows, *more))


def write_scan(folder: Path, mesh: Mesh, angle: float) -> None:
    """A scan of the wall turned about z and shifted on the floor, with perfect instances."""
    scan = ScanFolder(folder)
    c, s = np.cos(angle), np.sin(angle)
    turned = mesh.vertices @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [2.0, 1.0, 0.0]
    write_ply(scan.mesh, Mesh(turned, mesh.faces))
    face_instance = labels_on(mesh)
    InstanceTable(face_instance, np.ones(len(mesh.faces), np.float32)).save(scan.instances)
    records(TRUE).save(scan.instance_records)
    Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True).save(
        scan.scale
    )
    Routes(routes=(Route(1, holds=(1,)), Route(2, holds=(2,)))).save(scan.routes)


def write_model(folder: Path, poses: NDArray[np.float64], angle: float) -> None:
    """A COLMAP text model of the same cameras in the turned frame."""
    from scipy.spatial.transform import Rotation

    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    folder.mkdir(parents=True)
    lines = []
    for k, pose in enumerate(poses):
        rotation = pose[:, :3] @ turn.T
        shift = pose[:, 3] - rotation @ np.array([2.0, 1.0, 0.0])
        x, y, z, w = Rotation.from_matrix(rotation).as_quat()
        lines.append(f"{k + 1} {w} {x} {y} {z} {shift[0]} {shift[1]} {shift[2]} 1 IMG_{k:04d}.jpg")
        lines.append("")
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    (folder / "cameras.txt").write_text("1 PINHOLE 100 80 90 90 50 40\n")
    (folder / "points3D.txt").write_text("")


def test_scan_command_end_to_end(tmp_path: Path, truth: Truth) -> None:
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(3)
    rotations = Rotation.random(5, rng=rng).as_matrix()
    poses = np.concatenate([rotations, rng.normal(size=(5, 3, 1))], axis=2)
    size, intrinsics = np.array([100, 80]), np.array([90.0, 90, 50, 40])
    write_truth(tmp_path / "gym", truth, cam_from_world=poses, size=size, intrinsics=intrinsics)
    write_scan(tmp_path / "scan", grid(60), angle=0.7)
    write_model(tmp_path / "scan/sparse", poses, angle=0.7)
    command = ["evaluate", "scan", str(tmp_path / "scan"), "--truth", str(tmp_path / "gym")]
    assert run_command(*command, "--align") == 0
    written = json.loads((tmp_path / "scan/evaluation/evaluation.json").read_text())
    assert [fit["fit"] for fit in written["fits"]] == ["heading and place", "similarity"]
    for fit in written["fits"]:
        assert fit["poses"]["centre_max_mm"] < 1e-3
        assert fit["mesh"]["accuracy_8mm"] == pytest.approx(1.0)
        assert fit["mesh"]["completeness_10mm"] == pytest.approx(1.0)
        assert fit["instances"]["agnostic"]["ap"] == pytest.approx(1.0)
        assert fit["instances_on_true_mesh"]["agnostic"]["ap"] == pytest.approx(1.0)
        assert fit["semantics"]["miou"] > 0.95
        assert fit["routes"]["ari"] == 1.0
    assert (tmp_path / "scan/evaluation/errors.glb").stat().st_size > 1000
    assert (tmp_path / "scan/evaluation/errors.ply").is_file()


def test_what_is_guessed_changes_no_figure(tmp_path: Path, truth: Truth) -> None:
    mesh, scan = grid(60), ScanFolder(tmp_path / "scan")
    write_scan(scan.root, mesh, angle=0.0)
    whole, table = read_mesh(scan.mesh), InstanceTable.load(scan.instances)
    placed = replace(truth, mesh=Mesh(truth.mesh.vertices + [2.0, 1.0, 0.0], truth.mesh.faces))
    before = evaluate_scan(scan, placed, similarity=False).figures
    # A second wall before the first, all of it guessed and of hold 1.
    count = len(whole.faces)
    doubled = Mesh(
        np.concatenate([whole.vertices, whole.vertices + [0.01, 0.01, 0.0]]),
        np.concatenate([whole.faces, whole.faces + len(whole.vertices)]).astype(np.int32),
        None,
        np.arange(2 * count) >= count,
    )
    write_ply(scan.mesh, doubled)
    InstanceTable(
        np.concatenate([table.face_instance, np.ones(count, np.int32)]),
        np.concatenate([table.face_score, np.zeros(count, np.float32)]),
    ).save(scan.instances)
    assert evaluate_scan(scan, placed, similarity=False).figures == before
    assert before["instances"]["agnostic"]["ap50"] > 0.9
    write_ply(scan.mesh, whole)
    with pytest.raises(InputError, match="lift again"):
        evaluate_scan(scan, placed, similarity=False)


def test_a_doubtful_instance_is_ranked_but_not_shown(tmp_path: Path) -> None:
    mesh, scan = grid(60), ScanFolder(tmp_path / "scan")
    write_scan(scan.root, mesh, angle=0.0)
    face_instance = InstanceTable.load(scan.instances).face_instance
    # A false instance of low score on bare wall, in the lift's files but not among the holds.
    free = np.flatnonzero(face_instance == 0)[:200]
    face_instance[free] = 99
    InstanceTable(face_instance, np.ones(len(mesh.faces), np.float32)).save(scan.instances)
    false = InstanceRecord(99, 1, "hold", 0.1, {"1": 1.0}, (), 200)
    records(TRUE, false).save(scan.instance_records)

    placed = Truth(
        Mesh(mesh.vertices + [2.0, 1.0, 0.0], mesh.faces),
        labels_on(mesh),
        np.ones(len(mesh.faces), np.int32),
        TRUE,
    )

    def measured() -> dict[str, Any]:
        return evaluate_scan(scan, placed, similarity=False).figures

    before = measured()
    assert before["shown"]["precision"] == pytest.approx(3 / 4)
    Holds(metric=True, holds=tuple(Hold(k, "hold") for k in TRUE)).save(scan.holds)
    after = measured()
    assert after["instances"] == before["instances"]
    assert after["instances"]["agnostic"]["predicted"] == 4
    assert (after["shown"]["shown"], after["shown"]["hits"], after["shown"]["recall"]) == (
        3,
        3,
        1.0,
    )
    assert after["shown"]["precision"] == 1.0
    assert after["semantics"]["miou"] == pytest.approx(1.0)
    assert after["semantics_all"] == before["semantics"]
    assert after["semantics_all"]["miou"] < 0.99


def test_operating_point_by_hand() -> None:
    truth = Labelled(np.array([1, 1, 2, 2, 3, 0], np.int32), {1: 1, 2: 1, 3: 2})
    found = Labelled(
        np.array([5, 5, 6, 7, 8, 9], np.int32),
        {5: 1, 6: 1, 7: 1, 8: 1, 9: 1},
        {5: 0.9, 6: 0.8, 7: 0.7, 8: 0.3, 9: 0.2},
    )
    everything = operating_point([overlap_of_faces(found, truth, np.ones(6))])
    # 5 meets 1; 6 and 7 have half of 2 each, which is not more than half; 8 meets 3 in the
    # wrong class; 9 is false.
    assert (everything.shown, everything.truth) == (5, 3)
    assert (everything.hits, everything.hits_of_class) == (2, 1)
    kept = at_score(found, 0.3)
    assert kept.face_instance.tolist() == [5, 5, 6, 7, 8, 0]
    surer = operating_point([overlap_of_faces(kept, truth, np.ones(6))])
    assert surer.as_dict()["precision"] == pytest.approx(2 / 4)
    assert surer.as_dict()["f1"] == pytest.approx(4 / 7)
    nothing = operating_point([overlap_of_faces(at_score(found, 1.0), truth, np.ones(6))])
    assert nothing.as_dict()["precision"] is None
    assert nothing.recall == 0.0


@pytest.mark.data
def test_gym_a_is_read(gym_a: Path) -> None:
    truth = read_truth(gym_a / "lift")
    assert len(truth.labelled.labels) == 149
    assert truth.instances[1].label == 2
    assert len(read_truth(gym_a).views) == 72
