"""Hold types by relief: a height map of the hold, and the network that classifies it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mesh
from walltopo.core.files import shipped_file
from walltopo.core.instances import triangles_of
from walltopo.describe.classify.geometry import Shape
from walltopo.geometry.similarity import plane_axes
from walltopo.geometry.zbuffer import render_ids
from walltopo.images.networks import Network, open_network
from walltopo.scans.holds import UNKNOWN

Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

SIDE = 32  # pixels of a relief

FINE = 96  # pixels across the window that is rendered before framing

MARGIN = 1.12  # side of the frame over the hold's longer extent

EDGE = 1.0  # percent of the hold's pixels at each end that may lie outside the frame

TALLEST = 3.0  # heights are clipped here, in half sides of the frame

FAR = 400.0  # camera distance in window sides: practically a parallel projection


@dataclass(frozen=True, eq=False)
class Relief:
    """The shape of a hold as a height map.

    Parameters
    ----------
    picture : (2, SIDE, SIDE) float32, row 0 on top: mean height over the wall in half sides of
        the frame (0 beside the hold), and the share of the pixel that the hold covers.
    side_m : side of the frame, metres.
    """

    picture: NDArray[np.float32]
    side_m: float

    @property
    def scalars(self) -> NDArray[np.float32]:
        """Return (2,) float32: logarithms of the frame's side and of the hold's height."""
        heights, cover = self.picture
        inside = heights[cover > 0.5]
        top = float(np.percentile(inside, 95)) if len(inside) else 0.0
        tall = max(0.5 * self.side_m * top, 1e-3)
        return np.array([np.log(self.side_m / 0.15), np.log(tall / 0.05)], dtype=np.float32)


def render_heights(
    vertices: Floats, faces: NDArray[np.integer[Any]], window: float, pixels: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Render a hold in parallel projection.

    Parameters
    ----------
    vertices : (V, 3) metres: right, down, into the wall; the wall's surface is z = 0.
    faces : (F, 3).
    window, pixels : side of the rendered square around the origin, in metres and pixels.

    Returns
    -------
    (pixels, pixels) heights over the wall in metres, 0 beside the hold; and the hold's mask.
    """
    camera = Camera("PINHOLE", pixels, pixels, (FAR * pixels, FAR * pixels, pixels / 2, pixels / 2))
    pose = np.eye(3, 4)
    pose[2, 3] = FAR
    face, depth = render_ids(vertices / window, faces.astype(np.int32), camera, pose)
    mask = face >= 0
    return np.where(mask, (FAR - np.where(mask, depth, 0)) * window, 0.0), mask


def frame_relief(heights: Floats, mask: NDArray[np.bool_], pixel: float) -> Relief | None:
    """Return the relief of a rendered hold, or None if no pixel is set.

    Parameters
    ----------
    heights : (h, w) over the wall, metres; mask : (h, w) bool, the pixels of the hold.
    pixel : side of a pixel, metres.
    """
    rows, columns = np.nonzero(mask)
    if len(rows) == 0:
        return None
    low = np.percentile(np.stack([rows, columns]), EDGE, axis=1)
    high = np.percentile(np.stack([rows, columns]), 100 - EDGE, axis=1) + 1
    half = max(2, int(np.ceil(0.5 * MARGIN * float((high - low).max()))))
    first = np.round((low + high) / 2).astype(int) - half
    square = np.zeros((2, 2 * half, 2 * half), dtype=np.float32)
    top, left = np.maximum(first, 0)
    bottom, right = np.minimum(first + 2 * half, mask.shape)
    part = slice(top - first[0], bottom - first[0]), slice(left - first[1], right - first[1])
    cover = mask[top:bottom, left:right]
    square[1][part] = cover
    square[0][part] = np.where(cover, heights[top:bottom, left:right], 0)
    shrunk = [cv2.resize(layer, (SIDE, SIDE), interpolation=cv2.INTER_AREA) for layer in square]
    small: NDArray[np.float32] = np.asarray(shrunk, dtype=np.float32)
    side = 2 * half * pixel
    mean = np.divide(small[0], small[1], out=np.zeros_like(small[0]), where=small[1] > 0.05)
    small[0] = np.clip(mean / (0.5 * side), -TALLEST, TALLEST)
    return Relief(small, side)


def reliefs(
    mesh: Mesh, face_instance: NDArray[np.int32], shapes: Mapping[int, Shape], unit: float
) -> dict[int, Relief]:
    """Return the relief of each instance with a shape, without those too small to render.

    Parameters
    ----------
    mesh, face_instance : the inputs of `measure_shapes`, which returned the shapes.
    unit : scan units per metre.
    """
    found = {}
    for number, rows in triangles_of(face_instance, shapes):
        relief = _relief_of(mesh, rows, shapes[number], unit)
        if relief is not None:
            found[number] = relief
    return found


def _relief_of(mesh: Mesh, rows: Ints, shape: Shape, unit: float) -> Relief | None:
    """Return the relief of the instance with these triangles."""
    axes = plane_axes(shape.normal)
    to_wall = np.stack([axes[0], -axes[1], -shape.normal])
    used, faces = np.unique(mesh.faces[rows], return_inverse=True)
    local = (mesh.vertices[used] - shape.position) @ to_wall.T
    local[:, 2] -= shape.standing_m
    low, high = np.percentile(local[:, :2], [0.5, 99.5], axis=0)
    window = 1.25 * float((high - low).max())
    if window <= 0:
        return None
    local[:, :2] -= (low + high) / 2
    heights, mask = render_heights(local / unit, faces.reshape(-1, 3), window / unit, FINE)
    return frame_relief(heights, mask, window / unit / FINE)


NONE_OF_THESE = "none of these"  # the network's class of instances that have no single type

BATCH = 128

# Test-time augmentation in (degrees, scale): the choice of rim triangles and the tilt of the wall
# should not decide the type.
AUGMENTATIONS = ((0.0, 1.0), (-10.0, 1.0), (10.0, 1.0), (0.0, 0.93), (0.0, 1.07))


def _augmented_reliefs(
    reliefs: Sequence[Relief], degrees: float, scale: float
) -> NDArray[np.float32]:
    """Return (n, 2, SIDE, SIDE) pictures of reliefs, rotated and scaled about their centre."""
    middle = (SIDE - 1) / 2
    matrix = cv2.getRotationMatrix2D((middle, middle), degrees, scale)
    turned = [
        [cv2.warpAffine(layer, matrix, (SIDE, SIDE)) for layer in relief.picture]
        for relief in reliefs
    ]
    return np.asarray(turned, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class TypeModel:
    """A loaded network of hold types.

    Parameters
    ----------
    network : the loaded file.
    names : its classes, including `NONE_OF_THESE`.
    certain : minimum probability of a named type.
    sides : minimum and maximum side of a relief's frame in the training data, metres.
    """

    network: Network
    names: tuple[str, ...]
    certain: float
    sides: tuple[float, float]

    def probabilities(self, reliefs: Sequence[Relief]) -> NDArray[np.float32]:
        """Return (n, classes) float32, rows sum to 1: the mean over `AUGMENTATIONS`."""
        rows = [np.zeros((0, len(self.names)), dtype=np.float32)]
        for first in range(0, len(reliefs), BATCH):
            block = reliefs[first : first + BATCH]
            scalars = np.stack([relief.scalars for relief in block])
            answers = [
                self.network.session.run(None, {"reliefs": pictures, "scalars": scalars})[0]
                for pictures in (_augmented_reliefs(block, *change) for change in AUGMENTATIONS)
            ]
            rows.append(np.mean(answers, axis=0))
        return np.vstack(rows)

    def names_of(self, reliefs: Sequence[Relief]) -> list[tuple[str, float]]:
        """Return the type of each hold, or "unknown", and its probability."""
        found = []
        for relief, row in zip(reliefs, self.probabilities(reliefs), strict=True):
            best = int(row.argmax())
            confidence, name = float(row[best]), self.names[best]
            known = self.sides[0] <= relief.side_m <= self.sides[1]
            if name == NONE_OF_THESE or confidence < self.certain or not known:
                name = UNKNOWN
            found.append((name, confidence))
        return found


@cache
def shipped_model() -> TypeModel:
    """Return the network in `models/hold_types.onnx`."""
    return open_model(shipped_file("hold_types.onnx"))


def open_model(path: Path) -> TypeModel:
    """Return a network that `walltopo train hold-types` wrote.

    Raises
    ------
    InputError : the file does not exist, or is another kind of network.
    """
    network = open_network(path, threads=1)  # the network is too small to gain from threads
    missing = sorted({"names", "certain", "sides"} - set(network.metadata))
    if missing:
        raise InputError(f"{path}: not a network of hold types: its metadata lack {missing}")
    low, high = network.read_numbers("sides", [0.0, np.inf])
    return TypeModel(network, network.names, network.number("certain", 1.0), (low, high))
