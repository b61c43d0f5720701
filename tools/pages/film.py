"""The films of README and docs/grades.md: looping animated WebP (`make film`, `make moves-film`).

    python -m tools.pages.film scan SCAN PICTURES docs/pictures/film.webp
    python -m tools.pages.film moves LEFT RIGHT docs/pictures/moves.webp

`scan` shows photos, mesh, masks, holds, routes and phone in about ten seconds. SCAN is a finished
scan; PICTURES has `whole.jpg`, `route.jpg` and `phone-route.jpg` of its page. `moves` shows how a
route may go for one climber and for another, side by side. LEFT and RIGHT are folders of pictures
that `viewer/tests/moves.mjs` took. An animated WebP plays wherever an image is shown.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps

from walltopo.core import Camera, InputError, View
from walltopo.geometry.mesh_files import read_mesh
from walltopo.geometry.zbuffer import render_ids
from walltopo.images.files import read_rgb
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceTable

Picture = Image.Image

SIZE = (720, 450)
RATE = 10  # frames per second
MOVES_RATE = 5  # the rate at which moves.mjs captures the climb
MAX_BYTES = 3_000_000
QUALITIES = (70, 60, 50, 40, 30)
GROUND = (238, 240, 244)
GREY = (150, 152, 156)
# Camera swing while the mesh is shown.
SWING_DEG = 22.0
SWING_PICTURES = 24


def film_of_scan(scan: ScanFolder, pictures: Path) -> list[Picture]:
    """Return the frames from photos to a page on a phone."""
    scenes = [
        _titled(_photos(scan), "photos of a phone"),
        _titled(_meshes(scan, coloured=False), "one mesh, in metres"),
        _titled(_masks(scan), "holds in each photo"),
        _titled(_meshes(scan, coloured=True), "holds in 3D"),
        _titled(_shown(pictures / "whole.jpg"), "routes, in the browser"),
        _titled(_shown(pictures / "route.jpg"), "one route"),
        _titled(_shown(pictures / "phone-route.jpg"), "on a phone"),
    ]
    return [frame for scene in scenes for frame in scene]


def film_of_moves(left: Path, right: Path) -> list[Picture]:
    """Return the frames of two folders, sorted by name, pairwise side by side.

    The first climber to reach the top waits there for the other.
    """
    sides = [[read_rgb(file) for file in sorted(folder.glob("*.png"))] for folder in (left, right)]
    last = [side[-1] for side in sides]
    return [
        Image.fromarray(np.hstack([last[k] if one is None else one for k, one in enumerate(pair)]))
        for pair in zip_longest(*sides)
    ]


def write_film(frames: Sequence[Picture], out: Path, rate: int) -> int:
    """Write frames as a looping animated WebP of `rate` frames per second; return its bytes.

    Raises
    ------
    InputError : the film is larger than 3 MB even at the lowest quality.
    """
    for quality in QUALITIES:
        # Store only the changes of each frame, because most of it is static.
        frames[0].save(
            out,
            save_all=True,
            append_images=list(frames[1:]),
            duration=1000 // rate,
            loop=0,
            quality=quality,
            method=4,
            minimize_size=True,
        )
        size = out.stat().st_size
        if size <= MAX_BYTES:
            return size
    raise InputError(f"{out}: {size} bytes, over {MAX_BYTES}", "Show fewer pictures.")


def _photos(scan: ScanFolder) -> Iterator[Picture]:
    """Yield frames in which the photos appear one by one on a contact sheet."""
    files = sorted(scan.photos.iterdir())[:20]
    columns = 5
    width, height = SIZE[0] // columns, SIZE[1] // -(-len(files) // columns)
    sheet = Image.new("RGB", SIZE, GROUND)
    for number, file in enumerate(files):
        small = Image.fromarray(read_rgb(file)).resize((width - 6, height - 6))
        sheet.paste(small, (number % columns * width + 3, number // columns * height + 3))
        if number % 2:
            yield sheet.copy()
    yield from [sheet] * 6


def _meshes(scan: ScanFolder, *, coloured: bool) -> Iterator[Picture]:
    """Yield the mesh from a swinging camera, in grey or with coloured holds."""
    mesh = read_mesh(scan.mesh)
    colour = np.tile(np.array(GREY, np.float64), (len(mesh.faces), 1))
    if coloured:
        labels = InstanceTable.load(scan.instances).face_instance
        for hold in Holds.load(scan.holds).holds:
            colour[labels == hold.id] = hold.colour_rgb
    light = 0.55 + 0.45 * np.abs(mesh.normals @ np.array([0.35, -0.75, 0.56]))
    shaded = np.vstack([colour * light[:, None], [GROUND]]).clip(0, 255).astype(np.uint8)
    front = _front(read_views(scan.sparse))
    for turn in SWING_DEG * np.sin(np.linspace(-1.0, 1.0, SWING_PICTURES) * np.pi / 2):
        view = _turned(front, float(turn))
        faces, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        yield Image.fromarray(shaded[faces]).resize(SIZE, Image.Resampling.LANCZOS)


def _front(views: Sequence[View]) -> View:
    """Return the most central camera pose, with the film's aspect ratio and twice its size."""
    centres = np.array([view.centre for view in views])
    # The pose that shows most: far from the wall, and not to one side.
    far = (centres - centres.mean(axis=0)) @ -np.mean([view.direction for view in views], axis=0)
    aside = np.linalg.norm(centres - np.median(centres, axis=0), axis=1)
    chosen = views[int(np.argmax(far - 0.5 * aside))]
    width, height = 2 * SIZE[0], 2 * SIZE[1]
    focal = 0.85 * chosen.camera.matrix()[0, 0] * height / chosen.camera.height
    camera = Camera("PINHOLE", width, height, (focal, focal, width / 2, height / 2))
    return View(chosen.name, camera, chosen.cam_from_world)


def _turned(view: View, turn_deg: float) -> View:
    """Return the camera rotated about the vertical axis through its target, 2.5 m ahead."""
    turn = np.radians(turn_deg)
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    target = view.centre + 2.5 * view.direction
    pose = view.cam_from_world
    rotation = pose[:, :3] @ about
    moved = pose[:, :3] @ target + pose[:, 3] - rotation @ target
    return View(view.name, view.camera, np.column_stack([rotation, moved]))


def _masks(scan: ScanFolder) -> Iterator[Picture]:
    """Yield the photo with the most masks, which appear one by one."""
    found = Detections.load(scan.detections)
    name = max(found.masks, key=lambda photo: len(found.masks[photo]))
    photo = read_rgb(scan.photos / name).astype(np.float64)
    rng = np.random.default_rng(3)
    masks = sorted(found.masks[name], key=lambda mask: (mask.y, mask.x))
    for part in np.array_split(np.arange(len(masks)), 12):
        for number in part:
            mask = masks[number]
            rows = slice(mask.y, mask.y + mask.bitmap.shape[0])
            columns = slice(mask.x, mask.x + mask.bitmap.shape[1])
            tint = rng.uniform(60, 255, 3)
            photo[rows, columns][mask.bitmap] *= 0.35
            photo[rows, columns][mask.bitmap] += 0.65 * tint
        yield _fitted(Image.fromarray(photo.astype(np.uint8)))
    yield from [_fitted(Image.fromarray(photo.astype(np.uint8)))] * 5


def _shown(file: Path) -> Iterator[Picture]:
    """Yield a picture for 1.5 seconds."""
    yield from [_fitted(Image.fromarray(read_rgb(file)))] * (RATE * 3 // 2)


def _fitted(picture: Picture) -> Picture:
    """Return the whole picture, scaled to the film's size and centred."""
    return ImageOps.pad(picture, SIZE, color=GROUND)


def _titled(scene: Iterable[Picture], title: str) -> Iterator[Picture]:
    """Yield each frame with the scene's title in its lower left corner."""
    font = ImageFont.load_default(size=20)
    for picture in scene:
        shown = picture.copy()
        draw = ImageDraw.Draw(shown)
        box = draw.textbbox((14, SIZE[1] - 36), title, font=font)
        draw.rounded_rectangle(
            (box[0] - 8, box[1] - 6, box[2] + 8, box[3] + 6), 6, fill=(20, 53, 39)
        )
        draw.text((14, SIZE[1] - 36), title, font=font, fill=(255, 255, 255))
        yield shown


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("kind", choices=("scan", "moves"))
    parser.add_argument("sources", nargs=2, type=Path)
    parser.add_argument("out", type=Path)
    args = parser.parse_args(arguments)
    first, second = args.sources
    if args.kind == "scan":
        size = write_film(film_of_scan(ScanFolder(first), second), args.out, RATE)
    else:
        size = write_film(film_of_moves(first, second), args.out, MOVES_RATE)
    sys.stdout.write(f"{args.out}: {size / 1e6:.2f} MB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
