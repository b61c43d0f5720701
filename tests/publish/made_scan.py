"""A small scan made by formula: a panel with bumps as holds, a painted texture, two cameras."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Mesh, Progress, Silent
from walltopo.geometry.mesh_files import write_ply
from walltopo.pipeline.runner import run_stage
from walltopo.publish.outputs import export_wall
from walltopo.publish.settings import ExportSettings
from walltopo.publish.wall_data import WallModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds, with_routes
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.manifest import Manifest, Metrics, StageRecord
from walltopo.scans.photos import Photo, PhotoList, SkippedFile
from walltopo.scans.pictures import INDEX, CutoutIndex, SceneLight, TextureUv
from walltopo.scans.routes import Route, Routes
from walltopo.scans.scale import Plate, Scale

WIDTH, HEIGHT = 6.0, 4.0  # metres
COLOURS = {"red": (200, 40, 40), "blue": (40, 80, 200), "green": (40, 150, 60)}
MARKUP = '<img src=x onerror="window.hacked=1"><b>Owl</b>'


def hold_places(count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(n, 2) x and z of the holds: columns of a route each, from bottom to top."""
    rows = max(2, round(np.sqrt(count * HEIGHT / WIDTH)))
    columns = -(-count // rows)
    x = (np.arange(columns) + 0.5) / columns * WIDTH
    z = (np.arange(rows) + 0.5) / rows * HEIGHT
    return np.array([(x[k // rows], z[k % rows]) for k in range(count)])


def panel(count: int, cells: int) -> tuple[Mesh, Any, Any, Any]:
    """Mesh in the plane y = 0 facing -y, labels, uv and hold places."""
    nx, nz = cells, round(cells * HEIGHT / WIDTH)
    gx, gz = np.meshgrid(np.linspace(0, WIDTH, nx + 1), np.linspace(0, HEIGHT, nz + 1))
    places = hold_places(count)
    radius = 0.4 * min(0.4, WIDTH / max(1.0, np.sqrt(count * WIDTH / HEIGHT)))
    bump = np.zeros_like(gx)
    for x, z in places:
        square = ((gx - x) ** 2 + (gz - z) ** 2) / radius**2
        bump = np.maximum(bump, 0.5 * radius * np.clip(1 - square, 0, None))
    vertices = np.stack([gx, -bump, gz], axis=-1).reshape(-1, 3)
    a = (np.arange(nz)[:, None] * (nx + 1) + np.arange(nx)).ravel()
    b, c, d = a + 1, a + nx + 2, a + nx + 1
    faces = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    middle = vertices[faces].mean(axis=1)
    labels = np.zeros(len(faces), np.int32)
    for number, (x, z) in enumerate(places, start=1):
        near = (middle[:, 0] - x) ** 2 + (middle[:, 2] - z) ** 2 < radius**2
        labels[near] = number
    flat = vertices[faces][..., [0, 2]] / [WIDTH, HEIGHT]
    uv = np.stack([flat[..., 0], 1 - flat[..., 1]], axis=-1).astype(np.float32)
    return Mesh(vertices, faces), labels, uv, (places, radius)


def write_texture(path: Path, places: Any, radius: float, colours: list[tuple[int, ...]]) -> None:
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (512, 342), (205, 198, 186))
    draw = ImageDraw.Draw(image)
    per_x, per_z = 512 / WIDTH, 342 / HEIGHT
    for (x, z), colour in zip(places, colours, strict=True):
        u, v = x * per_x, (HEIGHT - z) * per_z
        draw.ellipse(
            (u - radius * per_x, v - radius * per_z, u + radius * per_x, v + radius * per_z),
            fill=colour,
        )
    image.save(path)


def write_cameras(folder: Path, names: list[str]) -> None:
    """A COLMAP text model: cameras 6 m in front of the panel, looking along +y."""
    folder.mkdir(parents=True)
    (folder / "cameras.txt").write_text("1 SIMPLE_PINHOLE 320 240 240 160 120\n")
    lines = []
    for number, name in enumerate(names, start=1):
        centre = np.array([1.0 + number, -6.0, 1.7])
        rotation = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # x right, y down, z forward
        t = -rotation @ centre
        half = np.sqrt(0.5)  # the rotation by 90 degrees about x
        lines.append(f"{number} {half} {half} 0 0 {t[0]} {t[1]} {t[2]} 1 {name}\n\n")
    (folder / "images.txt").write_text("".join(lines))
    (folder / "points3D.txt").write_text("")


def build_scan(
    root: Path, holds: int = 12, cells: int = 90, metric: bool = True, missed: int = 0
) -> ScanFolder:
    """Write a scan folder as the earlier stages leave it; they missed the last so many holds."""
    scan = ScanFolder(root)
    root.mkdir(parents=True, exist_ok=True)
    mesh, labels, uv, (places, radius) = panel(holds, cells)
    write_ply(scan.mesh, mesh)
    labels[labels > holds - missed] = 0
    InstanceTable(labels, (labels > 0).astype(np.float32)).save(scan.instances)
    all_holds, holds = holds, holds - missed
    names = list(COLOURS)
    rows = max(2, round(np.sqrt(all_holds * HEIGHT / WIDTH)))
    colour_of = [names[(k // rows) % 3] for k in range(all_holds)]
    instances = [made_hold(k, places[k - 1], radius, colour_of[k - 1]) for k in range(1, holds + 1)]
    Holds(metric=metric, holds=tuple(instances)).save(scan.holds_raw)
    InstanceRecords(
        classes={"1": "hold"},
        instances=tuple(
            InstanceRecord(k, 1, "hold", 0.4 + 0.05 * (k % 12), {"1": 1.0}, (), 1)
            for k in range(1, holds + 1)
        ),
    ).save(scan.instance_records)
    members: dict[int, list[int]] = {}
    for number in range(1, holds + 1):
        members.setdefault((number - 1) // rows + 1, []).append(number)
    routes = [made_route(k, ids, colour_of[ids[0] - 1]) for k, ids in members.items()]
    for path in (scan.routes, scan.routes_raw):
        Routes(routes=tuple(routes)).save(path)
    Holds(metric=metric, holds=with_routes(instances, routes)).save(scan.holds)
    made_light(len(COLOURS)).save(scan.light)
    made_scale(metric).save(scan.scale)
    write_texture(scan.texture, places, radius, [COLOURS[c] for c in colour_of])
    TextureUv(uv).save(scan.texture_uv)
    write_photos(scan)
    scan.cutouts.mkdir()
    CutoutIndex(cutouts=()).save(scan.cutouts / INDEX)
    metrics = {
        "reprojection_px": 0.34,
        "unregistered": {"IMG_4.jpg": "too few <b>matches</b>"},
    }
    record = StageRecord("done", seconds=3.0, peak_mb=100.0, metrics=metrics)
    manifest = Manifest.load(scan.manifest)
    manifest.stages["sparse"] = record
    manifest.save(scan.manifest)
    return scan


def made_hold(number: int, place: Any, radius: float, colour: str) -> Hold:
    """A jug at `place` (x, z)."""
    x, z = map(float, place)
    red, green, blue = COLOURS[colour]
    return Hold(
        number,
        "hold",
        type="jug",
        type_confidence=0.7,
        colour=colour,
        colour_rgb=(red, green, blue),
        colour_confidence=0.9,
        position=(x, -0.5 * float(radius), z),
        size=2 * float(radius),
        area=0.05,
        steepness_deg=10.0,
        photos=("IMG_1.jpg",),
        review=number == 2,
        score=0.4 + 0.05 * (number % 12),
    )


def made_route(number: int, holds: list[int], colour: str) -> Route:
    """A route over all its holds; the second has a hostile name."""
    return Route(
        number,
        MARKUP if number == 2 else "",
        colour,
        tuple(holds),
        length=3.2,
        steepness_deg=10.0,
        start=tuple(holds[:1]),
        top=tuple(holds[-1:]),
    )


def made_light(photos: int) -> SceneLight:
    """The same light in all photos, and all over the wall."""
    none = np.zeros((0, 3))
    return SceneLight(np.zeros((photos, 3)), none, none, 0.5, 1.0)


def made_scale(metric: bool) -> Scale:
    """Return the scale of one plate."""
    plate = Plate(
        (0, 1, 2, 3),
        "a plate",
        used=metric,
        way="corners",
        scale=1.0,
        residual_mm=0.8,
        error_px=0.2,
        photos=("IMG_1.jpg",),
        problem="",
    )
    return Scale(
        method="measure",
        scale=1.0,
        metric=metric,
        up_known=metric,
        floor_known=metric,
        plates=(plate,),
    )


def write_photos(scan: ScanFolder) -> None:
    """Four photos, three of them registered, and a file that was skipped."""
    from PIL import Image

    photos = tuple(
        Photo(f"IMG_{k}.jpg", 320, 240, 240.0, f"IMG_{k}.jpg", 100.0) for k in (1, 2, 3, 4)
    )
    skipped = (SkippedFile("<script>window.hacked=1</script>.txt", "not an image"),)
    PhotoList(photos=photos, skipped=skipped).save(scan.photo_list)
    write_cameras(scan.sparse, [photo.name for photo in photos[:3]])
    scan.photos.mkdir()
    for photo in photos:
        Image.new("RGB", (320, 240), (90, 120, 90)).save(scan.photos / photo.name)


def export_scan(
    scan: ScanFolder, settings: ExportSettings | None = None, progress: Progress | None = None
) -> Metrics:
    """Run the export stage with the records of the other stages; return its metrics."""
    records = Manifest.load(scan.manifest).stages
    return run_stage(scan, "export", settings or ExportSettings(), progress, records=records)


def export_alone(root: Path, wall: WallModel, settings: ExportSettings) -> ScanFolder:
    """The page and the files of a wall, without a scan: no report."""
    scan, scratch = ScanFolder(root), root / "scratch"
    scratch.mkdir(parents=True)
    made = export_wall(wall, settings, scratch, Silent(), root / "tiers")
    Holds(metric=wall.metric, holds=tuple(wall.holds)).save(scan.holds)
    made.glb.save(scan.glb)
    made.page_assets.save(scan.page_assets)
    made.page.save(scan.page)
    scratch.rmdir()
    shutil.rmtree(root / "tiers")
    return scan
