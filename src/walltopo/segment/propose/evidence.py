"""The probability that a piece of surface is a hold, from masks, mesh and colour.

Two logistic regressions on a few named cues, one for pieces with masks and one for the others. They
are fitted on generated gyms (`benchmarks.evidence`) and stored in
`models/evidence.json`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects

from walltopo.core import Mesh, Progress, View
from walltopo.core.files import shipped_file
from walltopo.geometry.zbuffer import render_culled
from walltopo.images.colour import linear_from_srgb8, oklab_from_linear
from walltopo.scans.document import Document
from walltopo.scans.photos import PhotoSet
from walltopo.segment.propose.surroundings import Relief

Floats = NDArray[np.float64]

CUES = (
    "height",
    "steps",
    "rim",
    "size",
    "size_squared",
    "long",
    "around",
    "company",
    "support",
    "best",
    "masks",
    "apart",
    "agreement",
    "photos",
)
# Photos explain a piece without a mask if its colour differs from the wall's by at least
# `MIN_COLOUR_DISTANCE` (OKLab) in at least `MIN_PHOTOS` photos.
MIN_COLOUR_DISTANCE, MIN_PHOTOS = 0.03, 2
SPECK = 0.0002  # square metres


@dataclass(frozen=True)
class Masks:
    """The masks of a piece.

    Parameters
    ----------
    support : the lift's score, 0 if no mask was lifted to the piece.
    best : the highest score of the masks, 0 without masks.
    count : number of masks.
    """

    support: float = 0.0
    best: float = 0.0
    count: int = 0


class Weights(msgspec.Struct, frozen=True):
    """One logistic regression.

    Parameters
    ----------
    middle, spread : centre and scale by which the cues are standardised.
    weights, bias : coefficients of the regression.
    """

    middle: tuple[float, ...]
    spread: tuple[float, ...]
    weights: tuple[float, ...]
    bias: float

    def probability(self, cues: Floats) -> Floats:
        """Return the (n,) probabilities of (n, len(CUES)) cues."""
        scaled = (cues - np.array(self.middle)) / np.array(self.spread)
        return np.asarray(1 / (1 + np.exp(-(scaled @ np.array(self.weights) + self.bias))))


class EvidenceModel(Document, frozen=True, kw_only=True):
    """A fitted model, stored as a JSON file.

    Parameters
    ----------
    cues : names of the cues, in the order of the weights.
    masked, unmasked : regressions for pieces with masks and for the others, in which relief and
        colour weigh more.
    made_by : the command and its data, for people.
    """

    cues: tuple[str, ...]
    masked: Weights
    unmasked: Weights
    made_by: str = ""

    def __post_init__(self) -> None:
        both = (self.masked, self.unmasked)
        rows = [row for one in both for row in (one.middle, one.spread, one.weights)]
        if self.cues != CUES or any(len(row) != len(CUES) for row in rows):
            raise msgspec.ValidationError(f"expected the cues {', '.join(CUES)}")

    def probability(self, cues: Floats) -> Floats:
        """Return the (n,) probability that each piece is a hold; `cues` (n, len(CUES))."""
        masked = cues[:, CUES.index("masks")] > 0
        return np.where(masked, self.masked.probability(cues), self.unmasked.probability(cues))


def cues_of(relief: Relief, masks: Masks, tint: Tint) -> Floats:
    """Return the (len(CUES),) features of a piece, in the order of `CUES`."""
    size = float(np.clip(np.log(max(relief.area, 1e-6) / 0.01), -4, 4))
    return np.array(
        [
            np.clip(np.log(max(relief.height, 1e-4) / 0.01), -2, 3),
            np.clip(np.log(max(relief.height, 1e-4) / max(relief.noise, 2e-4)), -2, 5),
            relief.rim,
            size,
            size**2,
            np.log(max(relief.length, 1e-3) ** 2 / max(relief.area, 1e-6)),
            relief.around,
            np.log1p(relief.nearby_holds),
            np.sqrt(masks.support),
            masks.best,
            np.log1p(masks.count),
            min(tint.apart, 0.3) / 0.1,
            tint.agreement,
            np.log1p(tint.photos),
        ]
    )


def is_explained(relief: Relief, masks: Masks, tint: Tint) -> bool:
    """Return whether photos explain a piece: by a mask, or by a colour unlike the wall's.

    A speck of few triangles is never explained.
    """
    by_colour = tint.apart >= MIN_COLOUR_DISTANCE and tint.photos >= MIN_PHOTOS
    return relief.area >= SPECK and (masks.count > 0 or by_colour)


@cache
def shipped_model() -> EvidenceModel:
    """Return the model in `models/evidence.json`."""
    return EvidenceModel.load(shipped_file("evidence.json"))


LONG_SIDE = 720  # pixels: the longer side of downscaled photos
MIN_PIXELS = 12  # of a piece, and of the wall beside it
RING = 0.35  # of a piece's longer side: width of the margin in which wall counts as beside it


@dataclass(frozen=True, eq=False)
class PhotoView:
    """One photo, and the triangles of the mesh that it shows.

    Parameters
    ----------
    picture : (h, w, 3) uint8 sRGB; face : (h, w) int32, the triangle of each pixel, -1 = none.
    """

    picture: NDArray[np.uint8]
    face: NDArray[np.int32]


@dataclass(frozen=True)
class Tint:
    """The colour of a piece relative to the wall beside it.

    Parameters
    ----------
    apart : OKLab distance of the median difference over photos: 0 = the same colour.
    agreement : that distance over the median distance of single photos: 1 = all photos agree.
    photos : number of photos that show the piece and the wall beside it.
    """

    apart: float = 0.0
    agreement: float = 0.0
    photos: int = 0


def photo_views(
    mesh: Mesh, views: Sequence[View], photos: PhotoSet, progress: Progress
) -> Iterator[PhotoView]:
    """Yield the photos of a scan, at most `LONG_SIDE` long, with the triangle at each pixel."""
    progress.step("compare with the wall in photos", len(views))
    for view in views:
        factor = min(1.0, LONG_SIDE / max(view.camera.width, view.camera.height))
        camera = view.camera.scaled(factor)
        face, _ = render_culled(mesh, camera, view.cam_from_world)
        people = photos.people_mask(view.name, camera.width, camera.height)
        if people is not None:
            face[people] = -1
        picture = photos.read_rgb(view.name)
        if picture.shape[:2] != face.shape:
            size = (camera.width, camera.height)
            picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        yield PhotoView(picture, face)
        progress.advance()


def tints(
    views: Iterable[PhotoView], label: NDArray[np.int32], wall: NDArray[np.bool_]
) -> dict[int, Tint]:
    """Return the tint of each piece that a photo shows.

    Parameters
    ----------
    label : (F,) int32, the piece of each triangle, 0 = none.
    wall : (F,) bool, triangles of the wall.
    """
    ground = np.where(label > 0, label, np.where(wall, -1, 0)).astype(np.int32)
    rows: dict[int, list[Floats]] = {}
    for view in views:
        drawn = np.where(view.face >= 0, ground[np.maximum(view.face, 0)], 0).astype(np.int32)
        for number, difference in _colour_differences(view.picture, drawn):
            rows.setdefault(number, []).append(difference)
    return {number: _combine_tints(np.array(own)) for number, own in rows.items()}


def _combine_tints(rows: Floats) -> Tint:
    """Return the tint from the (n, 3) colour differences of n photos."""
    middle = np.median(rows, axis=0)
    lengths = np.linalg.norm(rows, axis=1)
    apart = float(np.linalg.norm(middle))
    return Tint(apart, min(1.0, apart / max(float(np.median(lengths)), 1e-6)), len(rows))


def _colour_differences(
    picture: NDArray[np.uint8], drawn: NDArray[np.int32]
) -> list[tuple[int, Floats]]:
    """Return each piece's OKLab colour minus that of the wall beside it, under neutral light."""
    found = []
    height, width = drawn.shape
    for number, box in enumerate(find_objects(np.maximum(drawn, 0)), start=1):
        if box is None:
            continue
        rows, columns = box
        pad = max(4, round(RING * max(rows.stop - rows.start, columns.stop - columns.start)))
        top, left = max(rows.start - pad, 0), max(columns.start - pad, 0)
        window = np.s_[top : min(rows.stop + pad, height), left : min(columns.stop + pad, width)]
        own = drawn[window] == number
        beside = drawn[window] == -1
        if own.sum() < MIN_PIXELS or beside.sum() < MIN_PIXELS:
            continue
        linear = linear_from_srgb8(picture[window].reshape(-1, 3))
        piece = np.median(linear[own.ravel()], axis=0)
        wall = np.median(linear[beside.ravel()], axis=0)
        # Scale the light so that the wall is middle grey: the difference of paints remains.
        light = max(float(wall.mean()), 1e-4) / 0.4
        pair = oklab_from_linear(np.stack([piece, wall]) / light)
        found.append((number, pair[0] - pair[1]))
    return found
