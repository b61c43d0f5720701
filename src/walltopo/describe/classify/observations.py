"""The pixels of each hold in the photos, and its cutouts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.core.parallel import map_ahead
from walltopo.geometry.rays import cube_numbers
from walltopo.images.colour import DARK, linear_from_srgb8, oklab_from_linear
from walltopo.images.files import read_rgb
from walltopo.scans.pictures import INDEX, Cutout, CutoutIndex, Cutouts

Floats = NDArray[np.float64]

Image = NDArray[np.uint8]

MIN_PIXELS = 12  # fewer pixels of a hold give no reliable colour

SHADE, SHINE = 10, 85  # percentiles of lightness between which a hold's pixels are kept

CHALK = 60  # minimum percentile of saturation: chalk reduces saturation

CLIPPED = 252  # minimum 8-bit value of an overexposed channel

WALL_STEP = 4  # every fourth pixel of every fourth row measures the light on the wall

MARGIN = 0.12  # around a cutout, as a share of its box

STEP = 0.01  # minimum depth step at an occluder, as a share of the distance


@dataclass(frozen=True, eq=False)
class HoldView:
    """One hold in one photo.

    Parameters
    ----------
    photo : number of the photo; hold : the instance's id.
    pixels : visible pixels of the hold, before erosion.
    clipped : share of overexposed pixels among those of its colour.
    linear : (3,) float64, typical linear RGB in the photo.
    sharpness : variance of the Laplacian of the grey crop.
    cut : whether the hold touches the border of the photo.
    hidden : share of the rim at which a nearer surface occludes the hold.
    crop : (h, w, 3) uint8 RGB, downscaled; mask : (h, w) bool, its visible pixels there.
    """

    photo: int
    hold: int
    pixels: int
    clipped: float
    linear: Floats
    sharpness: float
    cut: bool
    crop: Image
    mask: NDArray[np.bool_]
    hidden: float = 0.0

    @property
    def quality(self) -> float:
        """Return the weight of this view: visible pixels, less if cut off or overexposed."""
        return self.pixels * (0.5 if self.cut else 1.0) * (1 - 0.9 * self.clipped)


@dataclass(frozen=True, eq=False)
class WallLight:
    """The mean log linear RGB of wall patches in one photo.

    Parameters
    ----------
    photo : number of the photo.
    patch : (n,) int64 patch numbers; log_rgb : (n, 3) float64.
    """

    photo: int
    patch: NDArray[np.int64]
    log_rgb: Floats


def load_photo(path: Path, width: int, height: int) -> Image:
    """Return the (height, width, 3) uint8 RGB of a photo, resized by area.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    picture = read_rgb(path)
    if picture.shape[:2] != (height, width):
        picture = np.asarray(
            cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), dtype=np.uint8
        )
    return picture


def paint_of(pixels: Image) -> tuple[Floats, float]:
    """Return the typical linear RGB of a hold's pixels, and the clipped share of those used.

    The darkest pixels are deep shade, the brightest are highlights and screw heads. The more
    saturated of the other pixels are kept, because chalk and dust reduce saturation and shade does
    not. The three percentiles were chosen on generated gyms (docs/colours.md).

    Parameters
    ----------
    pixels : (n, 3) uint8 sRGB, n >= 1.
    """
    linear = linear_from_srgb8(pixels)
    lab = oklab_from_linear(linear)
    low, high = np.percentile(lab[:, 0], [SHADE, SHINE])
    kept = (lab[:, 0] >= low) & (lab[:, 0] <= high)
    saturation = np.linalg.norm(lab[:, 1:], axis=1) / (lab[:, 0] + DARK)
    kept &= saturation >= np.percentile(saturation[kept], CHALK)
    clipped = float((pixels[kept] >= CLIPPED).any(axis=1).mean())
    return np.median(linear[kept], axis=0), clipped


def wall_patches(mesh: Mesh, face_instance: NDArray[np.int32], cells: int) -> NDArray[np.int32]:
    """Return the (F,) int32 number of the wall patch of each face, -1 for faces of holds.

    Patches are cubes, `cells` of them along the longest side of the wall.
    """
    low = mesh.vertices.min(axis=0)
    side = max(float(np.ptp(mesh.vertices, axis=0).max()), 1e-9) / cells
    key = cube_numbers(mesh.centroids, low, side, cells)
    wall = face_instance == 0
    present = np.flatnonzero(np.bincount(key[wall]))
    number = np.zeros((cells + 1) ** 3, dtype=np.int32)
    number[present] = np.arange(len(present))
    return np.where(wall, number[key], np.int32(-1))


def _wall_light(
    photo: int, picture: Image, face_id: NDArray[np.int32], patch_of: NDArray[np.int32]
) -> WallLight:
    faces = face_id[::WALL_STEP, ::WALL_STEP].ravel()
    pixels = picture[::WALL_STEP, ::WALL_STEP].reshape(-1, 3)
    patch = np.where(faces >= 0, patch_of[np.maximum(faces, 0)], -1)
    usable = (patch >= 0) & (pixels.max(axis=1) < 250) & (pixels.min(axis=1) > 4)
    logs = np.log(linear_from_srgb8(pixels[usable]))
    numbers, inverse, counts = np.unique(patch[usable], return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(inverse, logs[:, k], len(numbers)) for k in range(3)], axis=1)
    enough = counts >= 8
    return WallLight(photo, numbers[enough], sums[enough] / counts[enough, None])


def hold_views(
    photo: int,
    picture: Image,
    ids: NDArray[np.int32],
    depth: NDArray[np.float32],
    erode: int,
    crop_px: int,
) -> Iterator[HoldView]:
    """Yield the view of each hold that a picture shows.

    Parameters
    ----------
    photo : number of the photo; picture : (h, w, 3) uint8 RGB.
    ids : (h, w) int32, the hold at each pixel, 0 = none; depth : (h, w) float32.
    erode, crop_px : see `read_hold_views`.
    """
    import cv2
    from scipy.ndimage import find_objects

    height, width = ids.shape
    for number, box in enumerate(find_objects(ids), start=1):
        if box is None:
            continue
        mask = ids[box] == number
        count = int(np.count_nonzero(mask))
        if count < MIN_PIXELS:
            continue
        core = inner_mask(mask, erode)
        linear, clipped = paint_of(picture[box][core])
        rows, columns = box
        pad = round(MARGIN * max(mask.shape))
        wide = (
            slice(max(rows.start - pad, 0), min(rows.stop + pad, height)),
            slice(max(columns.start - pad, 0), min(columns.stop + pad, width)),
        )
        grey = cv2.cvtColor(picture[wide], cv2.COLOR_RGB2GRAY)
        crop, cover = _shrink_copies(picture[wide], ids[wide] == number, crop_px)
        yield HoldView(
            photo=photo,
            hold=number,
            pixels=count,
            clipped=clipped,
            linear=linear,
            sharpness=float(cv2.Laplacian(grey, cv2.CV_64F).var()),
            cut=rows.start == 0
            or columns.start == 0
            or rows.stop == height
            or columns.stop == width,
            crop=crop,
            mask=cover,
            hidden=_occluded_share(ids[wide] == number, depth[wide]),
        )


def _occluded_share(mask: NDArray[np.bool_], depth: NDArray[np.float32]) -> float:
    """Return the share of the pixels around a mask that are clearly nearer than the mask."""
    import cv2

    kernel = np.ones((3, 3), np.uint8)
    around = (cv2.dilate(mask.astype(np.uint8), kernel) > 0) & ~mask
    if not around.any():
        return 0.0
    beside = cv2.dilate(np.where(mask, depth, 0).astype(np.float32), kernel)
    return float((depth < (1 - STEP) * beside)[around].mean())


def _shrink_copies(
    crop: Image, mask: NDArray[np.bool_], longest: int
) -> tuple[Image, NDArray[np.bool_]]:
    """Return copies at most `longest` pixels long, because thousands are in memory at once."""
    import cv2

    factor = longest / max(mask.shape)
    if factor >= 1:
        return crop.copy(), mask
    size = (max(1, round(mask.shape[1] * factor)), max(1, round(mask.shape[0] * factor)))
    small = cv2.resize(np.ascontiguousarray(crop), size, interpolation=cv2.INTER_AREA)
    cover = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8), np.asarray(cover >= 0.5)


def inner_mask(mask: NDArray[np.bool_], erode: int) -> NDArray[np.bool_]:
    """Return the mask without its rim, but at least its `MIN_PIXELS` innermost pixels.

    Pixels at the rim are a mixture with the wall, which makes small black holds grey.
    """
    import cv2

    padded = np.pad(mask, 1).astype(np.uint8)
    depth = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    innermost = np.partition(depth[mask], -MIN_PIXELS)[-MIN_PIXELS]
    return np.asarray((depth > erode) | (mask & (depth >= innermost)))


def read_hold_views(
    views: Sequence[View],
    load: Callable[[View, int, int], Image],
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    patch_of: NDArray[np.int32],
    *,
    long_side: int,
    erode: int,
    crop_px: int,
    hidden: Callable[[View, int, int], NDArray[np.bool_] | None] | None = None,
) -> Iterator[tuple[list[HoldView], WallLight]]:
    """Yield, for each photo, the views of its holds and the light on the wall.

    A pixel belongs to the hold whose triangle is visible there (z-buffer on the mesh), so that
    holds hidden behind others take no colour from them.

    Parameters
    ----------
    views : posed photos; `load(view, width, height)` returns the photo as (h, w, 3) uint8 RGB.
    face_instance : (F,) int32, 0 = wall; patch_of : (F,) see `wall_patches`.
    long_side : maximum length of a photo in pixels; longer photos are downscaled.
    erode : pixels removed from the rim, at that size.
    crop_px : maximum length of a crop, pixels.
    hidden : returns the pixels of people in the photo, as `load`; None without any.
    """
    from walltopo.geometry.zbuffer import render_culled

    def read(number: int) -> tuple[list[HoldView], WallLight]:
        view = views[number]
        factor = min(1.0, long_side / max(view.camera.width, view.camera.height))
        camera = view.camera.scaled(factor)
        face_id, depth = render_culled(mesh, camera, view.cam_from_world)
        people = hidden(view, camera.width, camera.height) if hidden is not None else None
        if people is not None:
            face_id[people] = -1
        ids = np.where(face_id >= 0, face_instance[np.maximum(face_id, 0)], 0).astype(np.int32)
        picture = load(view, camera.width, camera.height)
        return (
            list(hold_views(number, picture, ids, depth, erode, crop_px)),
            _wall_light(number, picture, face_id, patch_of),
        )

    yield from map_ahead(read, range(len(views)))


def best_views(views: Sequence[HoldView], count: int) -> list[HoldView]:
    """Return the views with the most pixels, best first; blurred views come last."""
    if not views:
        return []
    limit = 0.3 * float(np.median([view.sharpness for view in views]))
    ranked = sorted(views, key=lambda v: (v.sharpness < limit, -v.quality, v.photo))
    return ranked[:count]


def write_cutouts(
    folder: Path, views: Mapping[int, Sequence[HoldView]], photos: Sequence[str]
) -> Cutouts:
    """Write `<id>_<rank>.webp` (RGB with the hold's mask as alpha) and the index.

    Parameters
    ----------
    folder : the folder, which must not exist yet.
    views : hold id to the views to keep, best first.
    photos : names of the photos, by number.
    """
    folder.mkdir()
    ranked = [(hold, rank, v) for hold in sorted(views) for rank, v in enumerate(views[hold])]

    def written(item: tuple[int, int, HoldView]) -> Cutout:
        hold, rank, view = item
        name = f"{hold:05d}_{rank}.webp"
        _write_cutout(folder / name, view)
        photo, sharpness = photos[view.photo], round(view.sharpness, 1)
        return Cutout(hold, name, photo, view.pixels, sharpness, view.cut)

    index = list(map_ahead(written, ranked))
    CutoutIndex(cutouts=tuple(index)).save(folder / INDEX)
    return Cutouts(folder, tuple(index))


def _write_cutout(path: Path, view: HoldView) -> None:
    from PIL import Image

    alpha = np.where(view.mask, 255, 0).astype(np.uint8)
    picture = Image.fromarray(np.dstack([view.crop, alpha]))
    picture.save(path, quality=80, method=2, exact=True)
