"""Ready meshes: their textures, their frames, and what the photos see of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from walltopo.core import Camera, InputError, Mesh, View
from walltopo.geometry.mesh_files import files_of_mesh, write_ply
from walltopo.geometry.similarity import fit_poses
from walltopo.geometry.subdivision import split_long_edges_with_uv
from walltopo.reconstruct.dense.given_mesh import GivenMesh, place_mesh
from walltopo.reconstruct.dense.mesh_file import read_mesh_file
from walltopo.reconstruct.dense.scene import Scene
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.artifacts import Context
from walltopo.scans.photos import Photo, PhotoList
from walltopo.scans.poses import GivenPoses, MeshFrame, PosedPhoto

COLOURS = {"red": (200, 0, 0), "blue": (0, 0, 200)}


def write_obj(folder: Path, repeats: bool = False) -> Path:
    """Two squares of two triangles, side by side, each with a picture of its own."""
    lines, materials = ["mtllib wall.mtl"], []
    for k, (name, colour) in enumerate(COLOURS.items()):
        Image.new("RGB", (8, 8), colour).save(folder / f"{name}.png")
        materials += [f"newmtl {name}", f"map_Kd {name}.png"]
        for x, y in ((k, 0), (k + 1, 0), (k + 1, 1), (k, 1)):
            lines.append(f"v {x} {y} 0")
        far = 3 if repeats else 1
        lines += ["vt 0 0", f"vt {far} 0", f"vt {far} 1", "vt 0 1", f"usemtl {name}"]
        a, b, c, d = (4 * k + n for n in range(1, 5))
        lines += [f"f {a}/{a} {b}/{b} {c}/{c}", f"f {a}/{a} {c}/{c} {d}/{d}"]
    (folder / "wall.mtl").write_text("\n".join(materials) + "\n")
    (folder / "wall.obj").write_text("\n".join(lines) + "\n")
    return folder / "wall.obj"


def colour_at(picture: np.ndarray, uv: np.ndarray) -> tuple[int, ...]:
    column, row = (uv * np.array(picture.shape[1::-1])).astype(int)
    return tuple(picture[row, column].tolist())


def test_several_pictures_become_one_and_seams_are_sewn(tmp_path: Path) -> None:
    found = read_mesh_file(write_obj(tmp_path))
    assert found.lacks == ""
    assert found.uv is not None
    assert found.picture is not None
    assert (len(found.mesh.vertices), len(found.mesh.faces)) == (6, 4)
    for face, uv in zip(found.mesh.centroids, found.uv, strict=True):
        expected = COLOURS["red" if face[0] < 1 else "blue"]
        assert colour_at(found.picture, uv.mean(axis=0)) == expected


def test_glb_keeps_its_texture(tmp_path: Path) -> None:
    picture = Image.new("RGB", (8, 8), COLOURS["red"])
    picture.paste(COLOURS["blue"], (0, 0, 8, 4))  # the upper half
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])  # trimesh: v upwards
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=picture)
    visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    faces = [[0, 1, 2], [0, 2, 3]]
    trimesh.Trimesh(vertices, faces, visual=visual, process=False).export(tmp_path / "a.glb")
    found = read_mesh_file(tmp_path / "a.glb")
    assert found.uv is not None
    assert found.picture is not None
    # The lower right triangle's centroid lies in the lower half.
    k = int(found.mesh.centroids[:, 1].argmin())
    assert colour_at(found.picture, found.uv[k].mean(axis=0)) == COLOURS["red"]
    assert colour_at(found.picture, found.uv[1 - k].mean(axis=0)) == COLOURS["blue"]


def test_an_unusable_texture_has_a_reason(tmp_path: Path) -> None:
    path = write_obj(tmp_path, repeats=True)
    assert "repeats" in read_mesh_file(path).lacks
    (tmp_path / "red.png").unlink()
    assert "none" in read_mesh_file(path).lacks
    assert read_mesh_file(path, "not wanted").lacks == "not wanted"


def test_files_that_a_mesh_refers_to_are_its_inputs(tmp_path: Path) -> None:
    names = {file.name for file in files_of_mesh(write_obj(tmp_path))}
    assert names == {"wall.mtl", "red.png", "blue.png"}
    (tmp_path / "out.obj").write_text("mtllib ../secret.mtl\nmtllib wall.mtl\n")
    assert len(files_of_mesh(tmp_path / "out.obj")) == 3


def test_the_texture_stays_where_it_is_when_edges_are_split() -> None:
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]])
    mesh = Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    uv = vertices[mesh.faces][..., :2] / 4
    finer, moved = split_long_edges_with_uv(mesh, uv, 0.3)
    assert len(finer.faces) > 100
    assert finer.areas.sum() == pytest.approx(8)
    np.testing.assert_allclose(moved, finer.vertices[finer.faces][..., :2] / 4, atol=1e-12)


def test_the_similarity_of_cameras_is_found_also_on_a_line() -> None:
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(3)
    turn = Rotation.from_rotvec([0.3, -1.0, 0.4]).as_matrix()
    scale, away = 2.5, np.array([1.0, -2.0, 3.0])
    for centres in (rng.standard_normal((6, 3)), np.outer(np.arange(4.0), [1, 2, 0.5])):
        source, target = [], []
        for k, centre in enumerate(centres):
            rotation = Rotation.from_rotvec(rng.standard_normal(3)).as_matrix()
            off = 5.0 if k == 5 else 0.0  # one camera is elsewhere
            source.append(np.column_stack([rotation, -rotation @ centre]))
            other = rotation @ turn.T
            place = scale * turn @ centre + away + off
            target.append(np.column_stack([other, -other @ place]))
        fit = fit_poses(np.array(source), np.array(target))
        np.testing.assert_allclose(fit.rotation, turn, atol=1e-9)
        np.testing.assert_allclose(fit.apply(centres), scale * centres @ turn.T + away, atol=1e-6)
    with pytest.raises(InputError, match="2 or more"):
        fit_poses(np.array(source[:1]), np.array(target[:1]))


# A wall with a ledge, so that no turn maps it to itself; cameras look at it along y.
HEIGHTS = np.array([[0.0, 2.0], [1.2, 2.0], [1.2, 1.6], [3.0, 1.6]])


def ledge(vertices: np.ndarray | None = None) -> Mesh:
    profile = HEIGHTS if vertices is None else vertices
    corners = [(x, y, z) for z, y in profile for x in (-2.0, 2.5)]
    faces = [[2 * k, 2 * k + 1, 2 * k + 3] for k in range(3)]
    faces += [[2 * k, 2 * k + 3, 2 * k + 2] for k in range(3)]
    return Mesh(np.array(corners), np.array(faces, np.int32))


def scene_and_poses(mesh_frame: MeshFrame | None = None) -> tuple[Scene, GivenPoses, PhotoList]:
    mesh = ledge()
    rng = np.random.default_rng(1)
    weights = rng.dirichlet((1, 1, 1), size=(len(mesh.faces), 60))
    points = np.einsum("fnk,fkc->fnc", weights, mesh.vertices[mesh.faces]).reshape(-1, 3)
    camera = Camera("PINHOLE", 640, 480, (400.0, 400.0, 320.0, 240.0))
    rotation = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    views = [
        View(f"{k}.jpg", camera, np.column_stack([rotation, -rotation @ np.array(centre)]))
        for k, centre in enumerate([(-1.0, -1.0, 1.9), (0.3, -1.2, 2.0), (1.0, -1.0, 1.8)])
    ]
    everything = np.arange(len(points))
    scene = Scene(tuple(views), points, (everything,) * 3)
    poses = GivenPoses(
        app="colmap",
        path="sparse",
        metric=False,
        up=None,
        photos=tuple(PosedPhoto.of(view) for view in views),
        mesh_frame=mesh_frame,
    )
    photos = tuple(Photo(v.name, 640, 480, None, v.name, 1.0) for v in views)
    return scene, poses, PhotoList(photos=photos)


def placed(mesh: Mesh, folder: Path, mesh_frame: MeshFrame | None = None) -> GivenMesh:
    scene, poses, photos = scene_and_poses(mesh_frame)
    write_ply(folder / "mesh.ply", mesh)
    settings = DenseSettings(mesh=str(folder / "mesh.ply"))
    return place_mesh(scene, poses, photos, False, 0.1, settings, Context(folder, folder))


def test_a_mesh_in_the_frame_of_the_poses_is_taken_as_it_is(tmp_path: Path) -> None:
    given = placed(ledge(), tmp_path)
    assert given.metrics["on_mesh"] > 0.6
    assert given.picture is None
    assert given.mesh.areas.sum() > 10
    edges = given.mesh.vertices[given.mesh.faces] - np.roll(
        given.mesh.vertices[given.mesh.faces], 1, axis=1
    )
    assert np.linalg.norm(edges, axis=2).max() <= 0.1334
    # Faces show the cameras their front, whatever the file's winding.
    turned = placed(Mesh(ledge().vertices, ledge().faces[:, ::-1]), tmp_path)
    for found in (given, turned):
        vertical = np.abs(found.mesh.normals[:, 1]) > 0.9
        assert (found.mesh.normals[vertical, 1] < 0).all()


def test_turned_axes_and_another_unit_are_found(tmp_path: Path) -> None:
    mesh = ledge()
    y_up = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    given = placed(Mesh(1000 * mesh.vertices @ y_up.T, mesh.faces), tmp_path)
    assert given.metrics["on_mesh"] > 0.6
    assert given.mesh.vertices[:, 1].max() == pytest.approx(2.0, abs=0.01)


def test_the_frame_of_the_apps_own_mesh_is_known(tmp_path: Path) -> None:
    mesh = ledge()
    frame = MeshFrame(1.0, ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (7.0, 0.0, -3.0))
    moved = Mesh(mesh.vertices + np.array([7.0, 0.0, -3.0]), mesh.faces)
    given = placed(moved, tmp_path, frame)
    assert given.mesh.vertices[:, 1].max() == pytest.approx(2.0, abs=0.01)


def test_a_mesh_that_the_photos_do_not_see_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="do not see this mesh") as failure:
        placed(Mesh(ledge().vertices + np.array([0, 1.0, 0]), ledge().faces), tmp_path)
    assert "mesh.ply" in failure.value.message
    with pytest.raises(InputError, match="no such file"):
        read_mesh_file(tmp_path / "nothing.ply")


@pytest.mark.parametrize(
    ("choice", "people", "used"),
    [("auto", False, True), ("auto", True, False), ("always", True, True), ("never", False, False)],
)
def test_a_texture_that_may_show_people_is_painted_anew(
    tmp_path: Path, choice: Any, people: bool, used: bool
) -> None:
    """People are hidden in the photos only."""
    scene, poses, photos = scene_and_poses(None)
    mesh = ledge()
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    texture = trimesh.visual.TextureVisuals(
        uv=np.column_stack([corners[:, 0] / 10 + 0.5, corners[:, 2] / 10 + 0.5]),
        image=Image.new("RGB", (8, 8), (200, 30, 40)),
    )
    faces = np.arange(len(corners)).reshape(-1, 3)
    file = tmp_path / "mesh.glb"
    trimesh.Trimesh(corners, faces, visual=texture, process=False).export(file)
    settings = DenseSettings(mesh=str(file), mesh_texture=choice)
    given = place_mesh(scene, poses, photos, people, 0.1, settings, Context(tmp_path, tmp_path))
    assert (given.picture is not None) == used
    assert given.metrics["own_texture"] == used
