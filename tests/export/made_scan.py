"""A small scan made by formula: a panel with bumps as holds, a painted texture, two cameras."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Mesh
from walltopo.core.files import write_json
from walltopo.meshes.ply import write_ply
from walltopo.scans.folder import ScanFolder

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
    root: Path,
    holds: int = 12,
    textured: bool = True,
    cells: int = 90,
    cameras: bool = True,
    metric: bool = True,
) -> ScanFolder:
    """Write a scan folder as the earlier stages leave it."""
    scan = ScanFolder(root)
    root.mkdir(parents=True, exist_ok=True)
    mesh, labels, uv, (places, radius) = panel(holds, cells)
    write_ply(scan.mesh, mesh)
    np.savez(scan.instances, face_instance=labels, face_score=(labels > 0).astype(np.float32))
    names = list(COLOURS)
    rows = max(2, round(np.sqrt(holds * HEIGHT / WIDTH)))
    colour_of = [names[(k // rows) % 3] for k in range(holds)]
    records: list[dict[str, Any]] = []
    attributes: list[dict[str, Any]] = []
    members: dict[int, list[int]] = {}
    for number in range(1, holds + 1):
        x, z = places[number - 1]
        colour = colour_of[number - 1]
        records.append(
            {"id": number, "label": 1, "class": "hold", "score": 0.4 + 0.05 * (number % 12)}
        )
        attributes.append(
            {
                "id": number, "class": "hold", "type": "jug", "type_confidence": 0.7,
                "colour": colour, "colour_rgb": list(COLOURS[colour]), "colour_confidence": 0.9,
                "position": [float(x), -0.5 * radius, float(z)], "normal": [0.0, -1.0, 0.0],
                "size_m": 2 * radius, "area_m2": 0.05, "steepness_deg": 10.0,
                "photos": ["IMG_1.jpg"], "role": "hold", "review": number == 2,
            }
        )  # fmt: skip
        members.setdefault((number - 1) // rows + 1, []).append(number)
    routes = [
        {
            "id": k, "colour": colour_of[ids[0] - 1], "holds": ids, "length_m": 3.2,
            "steepness_deg": 10.0, "start": ids[:1], "top": ids[-1:], "footholds": [],
            "ambiguous": [], **({"name": MARKUP} if k == 2 else {}),
        }
        for k, ids in members.items()
    ]  # fmt: skip
    write_json(scan.instance_records, {"version": 1, "instances": records})
    write_json(scan.attributes, {"version": 1, "palette": [], "instances": attributes})
    write_json(scan.routes, {"version": 1, "routes": routes, "unrouted": [], "volumes": []})
    write_json(
        scan.scale,
        {
            "version": 1,
            "metric": metric,
            "method": "measure",
            "plates": [
                {"ids": [0, 1, 2, 3], "residual_mm": 0.8, "photos": ["IMG_1.jpg"], "problem": ""}
            ],
        },
    )
    photos = [{"name": f"IMG_{k}.jpg", "width": 320, "height": 240} for k in (1, 2, 3, 4)]
    skipped = [{"source": "<script>window.hacked=1</script>.txt", "reason": "not an image"}]
    write_json(scan.photo_list, {"version": 1, "photos": photos, "skipped": skipped})
    if textured:
        write_texture(scan.texture, places, radius, [COLOURS[c] for c in colour_of])
        np.savez(scan.texture_uv, uv=uv)
    if cameras:
        write_cameras(scan.sparse, ["IMG_1.jpg", "IMG_2.jpg", "IMG_3.jpg"])
        from PIL import Image

        scan.photos.mkdir()
        for photo in photos:
            Image.new("RGB", (320, 240), (90, 120, 90)).save(scan.photos / str(photo["name"]))
    manifest = {
        "stages": {
            "sparse": {
                "state": "done",
                "seconds": 3.0,
                "peak_mb": 100.0,
                "metrics": {
                    "reprojection_px": 0.34,
                    "unregistered": {"IMG_4.jpg": "too few <b>matches</b>"},
                },
            }
        }
    }
    scan.manifest.write_text(json.dumps(manifest))
    return scan
