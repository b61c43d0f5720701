"""Painted meshes: colours in and out, materials, projection into photos, and back into a scan."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mesh, View
from walltopo.geometry.mesh_files import write_ply
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo_lab.cli import dataset as commands
from walltopo_lab.datasets.legend import Legend, object_colours, read_legend, write_legend
from walltopo_lab.datasets.painted import paint_instances, read_painted, write_painted
from walltopo_lab.datasets.project import masks_of_view, project_labels
from walltopo_lab.datasets.read import read_dataset


def grid(n: int = 20) -> Mesh:
    """A 1 m square in the plane z = 0, facing up."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + 1, corner + n + 2, corner + n + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Mesh(vertices, faces.astype(np.int32))


def two_objects(mesh: Mesh) -> NDArray[np.int32]:
    x, y, _ = mesh.centroids.T
    face_instance = np.zeros(len(mesh.faces), dtype=np.int32)
    face_instance[(x > 0.1) & (x < 0.4) & (y > 0.1) & (y < 0.4)] = 1
    face_instance[(x > 0.6) & (x < 0.9) & (y > 0.6) & (y < 0.9)] = 2
    return face_instance


@given(count=st.integers(1, 700))
@settings(max_examples=30, deadline=None)
def test_object_colours_are_apart_and_not_grey(count: int) -> None:
    colours = object_colours(count).astype(int)
    assert len(np.unique(colours, axis=0)) == count
    assert (colours.max(axis=1) - colours.min(axis=1)).min() >= 80


def test_paint_and_read_back(tmp_path: Path) -> None:
    mesh = grid()
    face_instance, labels = two_objects(mesh), {1: 1, 2: 2}
    colours, legend = paint_instances(face_instance, labels, ("hold", "volume"))
    write_painted(tmp_path / "p.ply", mesh, colours)
    write_legend(tmp_path / "p.legend.json", legend)
    again = read_painted(tmp_path / "p.ply", read_legend(tmp_path / "p.legend.json"))
    assert again.mesh.centroids == pytest.approx(mesh.centroids, abs=1e-6)
    for number in (1, 2):
        (mine,) = set(again.face_instance[face_instance == number].tolist())
        assert again.labels[mine] == labels[number]
        assert (again.face_instance == mine).sum() == (face_instance == number).sum()
    assert not again.face_instance[face_instance == 0].any()


def test_new_colours_are_new_objects_and_near_ones_are_listed_ones(tmp_path: Path) -> None:
    mesh = grid()
    colours = np.full((len(mesh.faces), 3), 189, dtype=np.uint8)  # the wall, rounded
    colours[two_objects(mesh) == 1] = (254, 1, 0)
    colours[two_objects(mesh) == 2] = (10, 200, 30)
    write_painted(tmp_path / "p.ply", mesh, colours)
    legend = Legend(objects={(255, 0, 0): "volume"})
    painted = read_painted(tmp_path / "p.ply", legend)
    by_colour = {painted.colours[k]: label for k, label in painted.labels.items()}
    assert by_colour == {(255, 0, 0): 2, (10, 200, 30): 1}


def test_split_parts_of_one_colour(tmp_path: Path) -> None:
    mesh = grid()
    colours = np.full((len(mesh.faces), 3), 190, dtype=np.uint8)
    colours[two_objects(mesh) > 0] = (255, 0, 0)
    write_painted(tmp_path / "p.ply", mesh, colours)
    assert len(read_painted(tmp_path / "p.ply").labels) == 1
    assert len(read_painted(tmp_path / "p.ply", split=True).labels) == 2


def test_materials_of_an_obj(tmp_path: Path) -> None:
    mesh = grid(6)
    of_face = two_objects(mesh)
    lines = ["mtllib m.mtl", *(f"v {x} {y} {z}" for x, y, z in mesh.vertices)]
    for number, material in enumerate(("wall", "hold red", "volume")):
        lines.append(f"usemtl {material.replace(' ', '_')}")
        lines += [
            "f {} {} {}".format(*(face + 1))
            for face in mesh.faces[of_face == number].tolist() and mesh.faces[of_face == number]
        ]
    (tmp_path / "m.obj").write_text("\n".join(lines) + "\n")
    names = ("wall", "hold_red", "volume")
    (tmp_path / "m.mtl").write_text(
        "".join(f"newmtl {n}\nKd 0.5 0.{k} 0.1\n" for k, n in enumerate(names))
    )
    painted = read_painted(tmp_path / "m.obj")
    assert sorted(painted.labels.values()) == [1, 2]


def test_mesh_without_colours_is_refused(tmp_path: Path) -> None:
    write_ply(tmp_path / "m.ply", grid())
    with pytest.raises(InputError, match="colours"):
        read_painted(tmp_path / "m.ply")
    (tmp_path / "l.json").write_text('{"objects": {"red": "hold"}}')
    with pytest.raises(InputError, match="red"):
        read_legend(tmp_path / "l.json")
    (tmp_path / "l.json").write_text('{"objects": {"#ff0000": "tree"}}')
    with pytest.raises(InputError, match="classes"):
        read_legend(tmp_path / "l.json")


def overhead(height: float = 2.0) -> View:
    """A camera over the middle of the square that looks down; y of the world is up in it."""
    rotation = np.diag([1.0, -1.0, -1.0])
    centre = np.array([0.5, 0.5, height])
    camera = Camera("PINHOLE", 200, 200, (300.0, 300.0, 100.0, 100.0))
    return View("a.jpg", camera, np.column_stack([rotation, -rotation @ centre]))


def test_projection_is_where_the_camera_says() -> None:
    mesh = grid()
    masks = dict(masks_of_view(mesh, two_objects(mesh), {1: 1, 2: 2}, overhead()))
    # Object 1 spans x and y .1 to .4: 150 px a metre about the centre (100, 100).
    assert masks[1].box == pytest.approx((40, 115, 45, 45), abs=1)
    assert masks[1].area == pytest.approx(45 * 45, rel=0.05)
    assert masks[2].label == 2


def test_occluded_objects_are_cut() -> None:
    mesh = grid()
    lid = grid(1)
    lid_vertices = lid.vertices * [0.5, 1, 1] + [0, 0, 0.5]
    both = Mesh(
        np.concatenate([mesh.vertices, lid_vertices]),
        np.concatenate([mesh.faces, lid.faces + len(mesh.vertices)]),
    )
    labels = np.concatenate([two_objects(mesh), np.zeros(len(lid.faces), np.int32)])
    masks = dict(masks_of_view(both, labels, {1: 1, 2: 2}, overhead()))
    assert set(masks) == {2}
    dataset = project_labels(both, labels, {1: 1, 2: 2}, {1: "hold", 2: "volume"}, [overhead()])
    assert dataset.photos[0].annotations[0].extra == {"instance": 2}


def make_scan(folder: Path) -> ScanFolder:
    scan, mesh = ScanFolder(folder), grid()
    write_ply(scan.mesh, mesh)
    face_instance = two_objects(mesh)
    InstanceTable(face_instance, (face_instance > 0).astype(np.float32)).save(scan.instances)
    classes = {"1": "hold", "2": "volume"}
    records = [InstanceRecord(k, k, classes[str(k)], 0.5, {str(k): 1.0}, (), 1) for k in (1, 2)]
    InstanceRecords(classes=classes, instances=tuple(records)).save(scan.instance_records)
    return scan


def run_command(*words: str) -> int:
    parser = argparse.ArgumentParser()
    commands.register(parser.add_subparsers())
    args = parser.parse_args(["dataset", *words])
    return int(args.run(args))


def test_scan_painted_corrected_and_read_back(tmp_path: Path) -> None:
    scan = make_scan(tmp_path / "scan")
    painted = tmp_path / "p.ply"
    assert run_command("paint", str(scan.root), "-o", str(painted)) == 0
    # Somebody repaints object 2 as wall and adds a third object.
    again = read_painted(painted, read_legend(tmp_path / "p.legend.json"))
    x, y, _ = again.mesh.centroids.T
    colours = np.full((len(x), 3), 190, dtype=np.uint8)
    first = next(k for k, label in again.labels.items() if label == 1)
    colours[again.face_instance == first] = again.colours[first]
    colours[(x > 0.6) & (y < 0.3)] = (7, 130, 240)
    write_painted(painted, again.mesh, colours)
    assert run_command("unpaint", str(painted), str(scan.root)) == 0
    rows = InstanceRecords.load(scan.instance_records).instances
    assert [(row.id, row.label, row.score) for row in rows] == [(1, 1, 0.5), (3, 1, 1.0)]
    assert set(np.unique(InstanceTable.load(scan.instances).face_instance)) == {0, 1, 3}
    write_painted(painted, Mesh(again.mesh.vertices + 1, again.mesh.faces), colours)
    with pytest.raises(InputError, match="scan"):
        run_command("unpaint", str(painted), str(scan.root))


def test_project_command(tmp_path: Path) -> None:
    scan = make_scan(tmp_path / "scan")
    model = tmp_path / "model"
    model.mkdir()
    (model / "cameras.txt").write_text("1 PINHOLE 200 200 300 300 100 100\n")
    # A half turn about x: quaternion (0, 1, 0, 0).
    (model / "images.txt").write_text("1 0 1 0 0 -0.5 0.5 2.0 1 a.jpg\n\n")
    (model / "points3D.txt").write_text("")
    painted, out = str(tmp_path / "p.ply"), tmp_path / "labels"
    assert run_command("paint", str(scan.root), "-o", painted) == 0
    assert run_command("project", painted, "--cameras", str(model), "-o", str(out)) == 0
    polygons, rle = read_dataset(out), read_dataset(out / "rle")
    assert [a.label for a in polygons.photos[0].annotations] == [1, 2]
    assert all(a.polygons for a in polygons.photos[0].annotations)
    assert all(a.mask is not None for a in rle.photos[0].annotations)
    assert run_command("compare", str(out), str(out / "rle")) == 0
