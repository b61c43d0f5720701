"""The readers under test, and valid files as seeds for the damage."""

from __future__ import annotations

import io
import json
import shutil
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tools.fuzz.poses import make_poses, read_poses_of

if TYPE_CHECKING:
    from walltopo.scans.edits import EditLog


Files = dict[str, bytes]


@dataclass(frozen=True)
class Target:
    """A reader under test.

    Parameters
    ----------
    make : writes valid files in several variants, each into its own subfolder.
    read : reads a folder and uses the content as the product does.
    """

    make: Callable[[Path], None]
    read: Callable[[Path], object]


def _of(folder: Path) -> Files:
    return {
        item.relative_to(folder).as_posix(): item.read_bytes()
        for item in sorted(folder.rglob("*"))
        if item.is_file()
    }


@cache
def seeds(target: str) -> list[Files]:
    """Return the valid files of a target, one entry for each folder that `make` filled."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        TARGETS[target].make(root)
        return [_of(folder) for folder in sorted(root.iterdir())]


def warm() -> None:
    """Run every reader once, so that imports do not count as a reader's memory and time."""
    with tempfile.TemporaryDirectory() as name:
        for number, target in enumerate(TARGETS.values()):
            root = Path(name) / str(number)
            root.mkdir()
            target.make(root)
            for folder in sorted(root.iterdir()):
                target.read(folder)


# --- labels of photos ---


def _coco(folder: Path, name: str) -> None:
    from walltopo.core import Mask
    from walltopo.scans.detections import Detections

    bitmap = np.random.default_rng(0).random((6, 8)) > 0.5
    mask = Mask.from_full(np.pad(bitmap, 6), 1, 0.75)
    sizes = {"a.png": (20, 18), "b.png": (20, 18)}
    Detections({"a.png": (mask, mask)}, sizes, {1: "hold", 2: "volume"}).save(folder / name)
    data = json.loads((folder / name).read_text())
    rows = data["annotations"]
    rows.append(rows[0] | {"id": 3, "segmentation": [[2, 2, 9, 2, 9, 9], [4, 9, 9, 12, 5, 12]]})
    plain = {"size": [18, 20], "counts": [30, 5, 325]}
    rows.append(rows[0] | {"id": 4, "image_id": 2, "segmentation": plain, "route_id": 3})
    (folder / name).write_text(json.dumps(data))


def _pictures(folder: Path, *names: str) -> None:
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        Image.new("RGB", (20, 18), (90, 120, 60)).save(folder / name)


def _make_detections(root: Path) -> None:
    (root / "0").mkdir()
    _coco(root / "0", "d.json")


def _read_detections(folder: Path) -> object:
    from walltopo.scans.detections import Detections

    return Detections.load(folder / "d.json")


def _read_foreign(folder: Path) -> object:
    from walltopo.scans.coco_import import read_coco

    return read_coco(folder / "d.json")


def _make_sets(root: Path) -> None:
    from walltopo_lab.datasets.read import read_dataset, write_dataset

    first = root / "coco"
    _pictures(first, "a.png", "b.png")
    _coco(first, "labels.json")
    for kind in ("labelme", "labelme-embedded", "via", "yolo", "yolo-seg"):
        write_dataset(root / kind, read_dataset(first), kind)


def _read_set(folder: Path) -> object:
    """Convert a data set as `walltopo dataset convert` does, into two formats."""
    from walltopo_lab.datasets.read import read_dataset, write_dataset

    dataset = read_dataset(folder)
    for kind in ("coco-rle", "yolo-seg"):
        write_dataset(folder / "out" / kind, dataset, kind)
    return dataset


# --- cameras ---


def _make_models(root: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    pycolmap.set_random_seed(0)
    options = pycolmap.SyntheticDatasetOptions(
        num_rigs=1, num_cameras_per_rig=2, num_frames_per_rig=2, num_points3D=4
    )
    model = pycolmap.synthesize_dataset(options)
    for name in ("binary", "text"):
        (root / name).mkdir()
    model.write_binary(root / "binary")
    model.write_text(root / "text")


def _read_model(folder: Path) -> object:
    from walltopo.scans.colmap_model import open_model, read_views

    model = open_model(folder)
    points = np.array([point.xyz for point in model.points3D.values()])
    seen = [len(point.track.elements) for point in model.points3D.values()]
    marks = [mark.xy for image in model.images.values() for mark in image.points2D]
    model.compute_mean_reprojection_error()
    return points, seen, marks, [view.centre for view in read_views(folder)]


def _make_transforms(root: Path) -> None:
    (root / "0").mkdir()
    matrix = [[1, 0, 0, 0.5], [0, 1, 0, 2.0], [0, 0, 1, -1.0], [0, 0, 0, 1]]
    frames = [
        {"file_path": f"images/{k}.jpg", "transform_matrix": matrix, "k1": 0.01} for k in "ab"
    ]
    data = {"w": 96, "h": 72, "fl_x": 80.0, "cx": 48.0, "cy": 36.0, "frames": frames}
    (root / "0" / "transforms.json").write_text(json.dumps(data))


def _read_transforms(folder: Path) -> object:
    from walltopo.segment.lift_files import read_cameras

    return [view.project(np.zeros(3)) for view in read_cameras(folder / "transforms.json")]


# --- meshes ---


_POLYGONS = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 5\n"
    b"property float x\nproperty float y\nproperty float z\nelement face 2\n"
    b"property list uchar int vertex_indices\nend_header\n"
    + np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], "<f4").tobytes()
    + struct.pack("<BiiiiBiii", 4, 0, 1, 2, 3, 3, 1, 4, 2)
)


def _make_meshes(root: Path) -> None:
    import trimesh

    from walltopo.core import Mesh
    from walltopo.geometry.mesh_files import write_ply

    box = trimesh.creation.box()
    mesh = Mesh(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32))
    red = Mesh(mesh.vertices, mesh.faces, np.full((len(mesh.vertices), 3), 200, dtype=np.uint8))
    for name in ("plain", "red", "ascii", "obj", "glb", "gltf", "stl", "off", "polygons"):
        (root / name).mkdir()
    (root / "polygons" / "m.ply").write_bytes(_POLYGONS)
    write_ply(root / "plain" / "m.ply", mesh)
    write_ply(root / "red" / "m.ply", red, np.arange(len(mesh.faces), dtype=np.int32))
    (root / "ascii" / "m.ply").write_bytes(box.export(file_type="ply", encoding="ascii"))
    for kind in ("obj", "glb", "stl", "off"):
        box.export(root / kind / f"m.{kind}")
    (root / "obj" / "m.mtl").write_text("newmtl hold\nKd 1 0 0\nmap_Kd ../../../etc/passwd\n")
    with (root / "obj" / "m.obj").open("r+") as stream:
        text = stream.read()
        stream.seek(0)
        stream.write(f"mtllib m.mtl\nusemtl hold\n{text}")
    for name, data in box.export(file_type="gltf").items():
        (root / "gltf" / name.replace("model", "m")).write_bytes(data)


def _mesh_in(folder: Path) -> Path:
    paths = [path for path in sorted(folder.iterdir()) if path.suffix in _MESHES]
    return paths[0] if paths else folder / "m.ply"


def _read_meshes(folder: Path) -> object:
    from walltopo.geometry.mesh_files import read_mesh

    return read_mesh(_mesh_in(folder)).areas


def _make_painted(root: Path) -> None:
    _make_meshes(root)
    for folder in root.iterdir():
        if folder.name not in ("red", "obj"):
            shutil.rmtree(folder)
    colours = {"wall": ["#bebebe"], "objects": {"#c8c8c8": "volume"}, "tolerance": 2}
    for name in ("red", "obj"):
        (root / name / "m.legend.json").write_text(json.dumps(colours))


def _read_painted(folder: Path) -> object:
    from walltopo_lab.datasets.legend import read_legend
    from walltopo_lab.datasets.painted import read_painted

    return read_painted(_mesh_in(folder), read_legend(folder / "m.legend.json"), split=True)


_MESHES = {".ply", ".obj", ".glb", ".gltf", ".stl", ".off"}

# --- files of the scan folder ---


def _make_arrays(root: Path) -> None:
    from walltopo.scans.instances import InstanceTable
    from walltopo.scans.pictures import TextureUv

    for name in ("labels", "uv", "stored"):
        (root / name).mkdir()
    labels = np.arange(40, dtype=np.int32)
    InstanceTable(labels, np.ones(40, dtype=np.float32)).save(root / "labels" / "labels.npz")
    TextureUv(np.zeros((5, 3, 2), dtype=np.float32)).save(root / "uv" / "uv.npz")
    stream = io.BytesIO()
    np.savez(stream, face_instance=labels, face_score=np.ones(40, dtype=np.float32))
    (root / "stored" / "labels.npz").write_bytes(stream.getvalue())


def _read_arrays(folder: Path) -> object:
    from walltopo.scans.instances import InstanceTable
    from walltopo.scans.pictures import TextureUv

    if (folder / "uv.npz").is_file():
        return TextureUv.load(folder / "uv.npz")
    return InstanceTable.load(folder / "labels.npz")


def _documents() -> dict[str, Any]:
    """Return a valid value of each scan document by file name."""
    from walltopo.scans.holds import Hold, Holds, PaletteColour
    from walltopo.scans.instances import InstanceRecord, InstanceRecords
    from walltopo.scans.photos import Photo, PhotoList, SkippedFile
    from walltopo.scans.pictures import Cutout, CutoutIndex
    from walltopo.scans.routes import Ambiguous, Route, Routes
    from walltopo.scans.scale import Plate, Scale

    at = (0.0, 1.0, 2.0)
    hold = Hold(1, "hold", photos=("a.jpg",), score=0.5, route=1)
    route = Route(
        1,
        "Owl",
        "red",
        (1,),
        steepness_profile=((0.0, 5.0),),
        ambiguous=(Ambiguous(1, {"2": 0.5}),),
    )
    plate = Plate((0, 1, 2, 3), "board 0-3", True, "markers", 1.0, 0.1, 0.2, ("a.jpg",), "", (at,))
    return {
        "routes.json": Routes(routes=(route,), unrouted=(2,), volumes=(3,)),
        "holds.json": Holds(
            metric=True,
            palette=(PaletteColour("red", (200, 0, 0)),),
            holds=(hold,),
            left_out=(Hold(2, "hold", position=at, photos=("a.jpg",), left_out="small"),),
        ),
        "instances.json": InstanceRecords(
            classes={"1": "hold"},
            instances=(InstanceRecord(1, 1, "hold", 0.5, {"1": 1.0}, (("a.jpg", 0),), 9),),
        ),
        "photos.json": PhotoList(
            photos=(Photo("a.jpg", 20, 18, 30.0, "/b/a.heic", 12.5),),
            skipped=(SkippedFile("b.jpg", "blurred"),),
        ),
        "scale.json": Scale(
            method="measure",
            scale=1.0,
            metric=True,
            up_known=True,
            floor_known=True,
            plates=(plate,),
        ),
        "cutouts/index.json": CutoutIndex(cutouts=(Cutout(1, "1_0.png", "a.jpg", 30, 2.0, False),)),
        "edits.json": _log_of_all(),
    }


def _make_documents(root: Path) -> None:
    for number, (name, value) in enumerate(_documents().items()):
        path = root / str(number) / name
        path.parent.mkdir(parents=True)
        value.save(path)


def _read_documents(folder: Path) -> object:
    from walltopo.scans.schemas import SCHEMAS

    names = [name for name in SCHEMAS if (folder / name).is_file()]
    documents = [SCHEMAS[name].load(folder / name) for name in names]  # type: ignore[attr-defined]
    for number, document in enumerate(documents):
        document.save(folder / "again" / str(number))
    return documents


def _make_edits(root: Path) -> None:
    """Write an edit log with one entry of each kind."""
    root.mkdir(exist_ok=True)
    (root / "log").mkdir()
    _log_of_all().save(root / "log" / "edits.json")


def _log_of_all() -> EditLog:
    """Return an edit log with one entry of each kind."""
    from walltopo.scans import edits as log

    at = (0.0, 1.0, 2.0)
    one = log.Ref(1, at)
    return log.EditLog(
        edits=(
            log.SetHold(hold=one, colour="red", type="jug", kind="hold"),
            log.Remove(hold=one),
            log.Keep(hold=one),
            log.SetRole(hold=one, route=one, role="start"),
            log.Add(hold=log.Ref(9, at), radius=0.2),
            log.Paint(hold=one, at=at, radius_m=0.1),
            log.Cut(hold=one, points=(at, (1.0, 1.0, 2.0)), new=9),
            log.Join(holds=(one, log.Ref(2, at))),
            log.Merge(routes=(one, log.Ref(2, at))),
            log.Split(route=one, holds=(one,), new=3),
            log.Assign(hold=one, route=log.Ref(2, at)),
            log.SetProblem(hands=(one,), start=(one,), top=(one,), feet=(one,), new=4),
            log.Share(hold=one, route=log.Ref(2, at)),
            log.Leave(hold=one, route=one),
            log.SetRoute(route=one, name="Owl", grade="6b", date="2026-03-01", proposed=False),
        )
    )


def _read_edits(folder: Path) -> object:
    """Replay a log on a small wall."""
    from walltopo.scans.edits import EditLog

    return _replayed(EditLog.load(folder / "edits.json"))


def _replayed(log: EditLog) -> object:
    """Replay a log on a wall of one triangle and one hold, and return the notes."""
    from walltopo.core import Mesh
    from walltopo.editing.replay import replay
    from walltopo.editing.settings import EditSettings
    from walltopo.editing.snapshot import ScanSnapshot
    from walltopo.scans.holds import Hold, Holds
    from walltopo.scans.photos import PhotoSet
    from walltopo.scans.pictures import SceneLight
    from walltopo.scans.routes import Route, Routes

    corners = np.array([[0, 1, 2], [0.1, 1, 2], [0, 1, 2.1]])
    none = np.zeros((0, 3))
    wall = ScanSnapshot(
        mesh=Mesh(corners, np.array([[0, 1, 2]], dtype=np.int32)),
        labels=np.array([1], dtype=np.int32),
        numbers=frozenset({1}),
        found=Holds(metric=True, holds=(Hold(1, "hold", colour="red", position=(0.0, 1.0, 2.0)),)),
        routes=Routes(routes=(Route(1, colour="red", holds=(1,)),)),
        light=SceneLight(none, none, none, 0.5, 1.0),
        views=(),
        photos=PhotoSet(Path("photos")),
        settings=EditSettings(),
    )
    return replay(wall, log.edits).notes


def _make_tables(root: Path) -> None:
    from walltopo.reconstruct.scale.plates import BUILT_IN

    files = {
        "palette.toml": '[[colour]]\nname = "red"\nrgb = [200, 30, 40]\nrole = "hold"\n',
        "plates.toml": BUILT_IN,
        "classes.toml": '[[class]]\nname = "red jug"\ntype = "jug"\nrole = "hold"\n',
        "points.toml": '[left]\n"a.jpg" = [6.667, 9.0]\n"b.jpg" = [13.333, 9.0]\n',
    }
    for number, (name, text) in enumerate(files.items()):
        (root / str(number)).mkdir()
        (root / str(number) / name).write_text(text)


def _read_tables(folder: Path) -> object:
    from walltopo.core import Camera, View
    from walltopo.describe.classify.palette import read_palette
    from walltopo.reconstruct.scale.known_distance import named_points
    from walltopo.reconstruct.scale.plates import read_plates
    from walltopo_lab.classifier.cutout_classifier import read_classes

    if (folder / "palette.toml").is_file():
        return read_palette(folder / "palette.toml", 0.7)
    if (folder / "plates.toml").is_file():
        return [plate.corners(plate.ids[0]) for plate in read_plates(folder / "plates.toml")]
    if (folder / "classes.toml").is_file():
        return read_classes(folder / "classes.toml")
    camera = Camera("PINHOLE", 20, 18, (20.0, 20.0, 10.0, 9.0))
    poses = [np.column_stack([np.eye(3), [x, 0.0, 3.0]]) for x in (-0.5, 0.5)]
    views = [View(name, camera, pose) for name, pose in zip(("a.jpg", "b.jpg"), poses, strict=True)]
    return named_points(folder / "points.toml", views)


def _make_moves(root: Path) -> None:
    from walltopo.scans.moves import ClimberRow, GradeRow, MoveRow, Moves, RouteMoves

    start = MoveRow(limb="start", holds=(1, 2, 0, 3), hip=(0.0, -0.2, 1.0), effort=0.5)
    step = MoveRow(
        limb="left hand", holds=(4, 2, 0, 3), hip=(0.0, -0.2, 1.2), effort=1.5, beyond=0.1
    )
    adult = ClimberRow("adult", 1.75, 1.75, True, 1, (start, step))
    child = ClimberRow("child", 1.3, 1.3, False, 0, ())
    routes = (RouteMoves(1, (child, adult), GradeRow("6B", "7A", 0.8, 3)), RouteMoves(2, ()))
    (root / "0").mkdir()
    Moves(unit=1.0, routes=routes).save(root / "0" / "moves.json")


def _read_moves(folder: Path) -> object:
    """Read moves as the command does before the command writes the script for pages opened from
    disk.
    """
    from walltopo.scans.folder import ScanFolder, write_moves
    from walltopo.scans.moves import Moves

    moves = Moves.load(folder / "moves.json")
    write_moves(ScanFolder(folder), moves)
    return moves


# --- pictures ---


def _make_photos(root: Path) -> None:
    from PIL import Image

    pixels = np.random.default_rng(0).integers(0, 255, (24, 32, 3), dtype=np.uint8)
    image = Image.fromarray(pixels)
    exif = Image.Exif()
    exif[0x0112] = 6
    for kind in ("jpg", "png", "webp", "tif", "bmp"):
        (root / kind).mkdir()
        image.save(root / kind / f"p.{kind}", exif=exif if kind == "jpg" else Image.Exif())


def _read_photo(folder: Path) -> object:
    from walltopo.images.files import read_rgb
    from walltopo_lab.datasets.yolo import photo_size

    path = next(iter(sorted(folder.iterdir())), folder / "p.jpg")
    return photo_size(path), read_rgb(path)


TARGETS: dict[str, Target] = {
    "coco": Target(_make_detections, _read_detections),
    "coco-import": Target(_make_detections, _read_foreign),
    "sets": Target(_make_sets, _read_set),
    "colmap": Target(_make_models, _read_model),
    "transforms": Target(_make_transforms, _read_transforms),
    "poses": Target(make_poses, read_poses_of),
    "meshes": Target(_make_meshes, _read_meshes),
    "painted": Target(_make_painted, _read_painted),
    "arrays": Target(_make_arrays, _read_arrays),
    "documents": Target(_make_documents, _read_documents),
    "edits": Target(_make_edits, _read_edits),
    "moves": Target(_make_moves, _read_moves),
    "tables": Target(_make_tables, _read_tables),
    "pictures": Target(_make_photos, _read_photo),
}
