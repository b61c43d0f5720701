"""Small scenes with known truth, on which the lift's defaults were chosen.

A scene is a bent wall with bumps of many sizes, some touching, some on top of larger ones. Cameras
are held as by a person with a phone. Masks come from a z-buffer and are then degraded: missing,
fused with a neighbour, false, of the wrong class, with wrong borders, cut in half, found twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, Mask, Mesh, View

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
HOLD, VOLUME = 1, 2


@dataclass(frozen=True)
class MaskNoise:
    """Errors of masks: probabilities, and the border's error in pixels."""

    missing: float = 0.12
    border_px: int = 3
    fused: float = 0.08
    false: float = 0.05
    wrong_class: float = 0.03
    halved: float = 0.0
    twice: float = 0.0


@dataclass(frozen=True, eq=False)
class Scene:
    """A mesh, its truth (0 = none), and views with perfect masks.

    `face_views` is the number of views that see each face.
    """

    mesh: Mesh
    face_instance: NDArray[np.int32]
    labels: dict[int, int]
    views: tuple[View, ...]
    face_views: NDArray[np.int32]


def make_scene(
    seed: int,
    width: float = 5.0,
    height: float = 3.2,
    step: float = 0.012,
    objects: int = 60,
    views: int = 26,
    photo: tuple[int, int] = (1280, 960),
    depth_noise: float = 0.002,
) -> Scene:
    """Return a wall of `width` x `height` metres in steps of `step`, with bumps and views."""
    rng = np.random.default_rng(seed)
    cols, rows = round(width / step) + 1, round(height / step) + 1
    x, z = np.meshgrid(np.linspace(0, width, cols), np.linspace(0, height, rows))
    bend = rng.uniform(0.3, 0.7) * height
    y = 0.35 * np.maximum(z - bend, 0) + 0.15 * np.abs(x - width / 2)
    relief, vertex_object, labels = _bumps(rng, x, z, objects)
    y = -(y + relief) + rng.normal(0, depth_noise, x.shape)
    grid = np.arange(cols * rows, dtype=np.int32).reshape(rows, cols)
    a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
    c, d = grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    mesh = Mesh(np.stack([x, y, z], -1).reshape(-1, 3), faces)
    flat = vertex_object.ravel()
    # A face belongs to the object of at least two of its corners.
    corner = flat[faces]
    face_instance = np.where(
        (corner[:, 0] == corner[:, 1]) | (corner[:, 0] == corner[:, 2]), corner[:, 0], corner[:, 1]
    ).astype(np.int32)
    posed = [_random_view(rng, k, width, height, photo) for k in range(views)]
    return _photograph(mesh, face_instance, labels, posed)


def _bumps(
    rng: np.random.Generator, x: Floats, z: Floats, objects: int
) -> tuple[Floats, NDArray[np.int32], dict[int, int]]:
    relief = np.zeros_like(x)
    owner = np.zeros(x.shape, dtype=np.int32)
    labels = {}
    spots: list[tuple[float, float, float]] = []
    for number in range(1, objects + 1):
        volume = number <= max(1, objects // 14)
        size = rng.uniform(0.2, 0.45) if volume else 0.03 + rng.gamma(2.0, 0.02)
        if spots and not volume and rng.random() < 0.25:  # close to the previous object
            px, pz, psize = spots[-1]
            angle, gap = rng.uniform(0, 2 * np.pi), psize + size * rng.uniform(0.8, 1.6)
            cx, cz = px + gap * np.cos(angle), pz + gap * np.sin(angle)
        else:
            cx, cz = rng.uniform(0.2, x.max() - 0.2), rng.uniform(0.2, z.max() - 0.2)
        spots.append((cx, cz, size))
        labels[number] = VOLUME if volume else HOLD
        turn, squash, power = rng.uniform(0, np.pi), rng.uniform(0.45, 1), rng.uniform(1.2, 4)
        u = (np.cos(turn) * (x - cx) + np.sin(turn) * (z - cz)) / size
        v = (np.cos(turn) * (z - cz) - np.sin(turn) * (x - cx)) / (size * squash)
        inside = 1 - (np.abs(u) ** power + np.abs(v) ** power)
        bump = inside > 0
        rise = size * rng.uniform(0.3, 0.9) * (np.minimum(inside, 0.35) / 0.35)
        relief = np.where(bump, relief + rise, relief)
        owner[bump] = number
    return relief, owner, labels


def _random_view(
    rng: np.random.Generator, number: int, width: float, height: float, photo: tuple[int, int]
) -> View:
    target = np.array([rng.uniform(0.1, 0.9) * width, -0.3, rng.uniform(0.2, 0.8) * height])
    away = rng.uniform(1.6, 4.5)
    position = np.array([target[0] + away * rng.uniform(-0.7, 0.7), -0.5 - away, 1.6])
    position[2] += rng.uniform(-0.6, 0.8)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    camera = Camera(
        "PINHOLE", *photo, (0.74 * photo[0], 0.74 * photo[0], photo[0] / 2, photo[1] / 2)
    )
    pose = np.column_stack([rotation, -rotation @ position])
    return View(f"view_{number:04d}.jpg", camera, pose)


def _photograph(
    mesh: Mesh, face_instance: NDArray[np.int32], labels: dict[int, int], views: list[View]
) -> Scene:
    from walltopo.geometry.zbuffer import render_ids

    seen = np.zeros(len(mesh.faces), dtype=np.int32)
    done = []
    for view in views:
        ids, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        seen[np.unique(ids[ids >= 0])] += 1
        objects = np.where(ids >= 0, face_instance[ids], 0)
        numbers, sizes = np.unique(objects, return_counts=True)
        masks = tuple(
            Mask.from_full(objects == number, labels[int(number)])
            for number, size in zip(numbers, sizes, strict=True)
            if number > 0 and size >= 60
        )
        done.append(view.with_masks(masks))
    return Scene(mesh, face_instance, labels, tuple(done), seen)


def spoil(views: tuple[View, ...], noise: MaskNoise, seed: int) -> list[View]:
    """Return the views with masks like a detector's."""
    rng = np.random.default_rng(seed)
    return [view.with_masks(tuple(_spoil_view(view, noise, rng))) for view in views]


def _spoil_view(view: View, noise: MaskNoise, rng: np.random.Generator) -> list[Mask]:
    from scipy import ndimage

    found = []
    full = [mask.full() for mask in view.masks]
    centres = [np.array(ndimage.center_of_mass(bitmap)) for bitmap in full]
    for k, mask in enumerate(view.masks):
        if rng.random() < noise.missing:
            continue
        bitmap = full[k]
        if len(full) > 1 and rng.random() < noise.fused:
            away = [
                float(np.linalg.norm(centres[k] - c)) if j != k else 1e9
                for j, c in enumerate(centres)
            ]
            bitmap = bitmap | full[int(np.argmin(away))]
        if rng.random() < noise.halved:
            bitmap = _half(bitmap, rng)
        label = mask.label
        if rng.random() < noise.wrong_class:
            label = VOLUME if label == HOLD else HOLD
        copies = 2 if rng.random() < noise.twice else 1
        for _ in range(copies):
            spoilt = _shift_border(bitmap, noise.border_px, rng)
            if spoilt.any():
                found.append(Mask.from_full(spoilt, label, float(rng.uniform(0.55, 1.0))))
    for _ in range(rng.binomial(max(1, len(full)), noise.false)):
        found.append(_false_mask(view, rng))
    return [found[k] for k in rng.permutation(len(found))]


def _shift_border(bitmap: Bools, most: int, rng: np.random.Generator) -> Bools:
    from scipy import ndimage

    step = int(rng.integers(-most, most + 1))
    if step == 0 or not bitmap.any():
        return bitmap
    rows, cols = np.flatnonzero(bitmap.any(axis=1)), np.flatnonzero(bitmap.any(axis=0))
    window = (
        slice(max(0, rows[0] - most), rows[-1] + most + 1),
        slice(max(0, cols[0] - most), cols[-1] + most + 1),
    )
    shifted = np.zeros_like(bitmap)
    if step > 0:
        shifted[window] = ndimage.binary_dilation(bitmap[window], iterations=step)
    else:
        # The photo's edge is no border of the object.
        shifted[window] = ndimage.binary_erosion(bitmap[window], iterations=-step, border_value=1)
    return shifted


def _half(bitmap: Bools, rng: np.random.Generator) -> Bools:
    rows, cols = np.nonzero(bitmap)
    angle = rng.uniform(0, 2 * np.pi)
    along = np.cos(angle) * rows + np.sin(angle) * cols
    kept = along > np.quantile(along, rng.uniform(0.3, 0.6))
    half = np.zeros_like(bitmap)
    half[rows[kept], cols[kept]] = True
    return half


def _false_mask(view: View, rng: np.random.Generator) -> Mask:
    width, height = view.camera.width, view.camera.height
    cx, cy = rng.uniform(0, width), rng.uniform(0, height)
    rx, ry = rng.uniform(6, 60, 2)
    rows, cols = np.mgrid[:height, :width]
    bitmap = ((cols - cx) / rx) ** 2 + ((rows - cy) / ry) ** 2 < 1
    label = HOLD if rng.random() < 0.9 else VOLUME
    return Mask.from_full(bitmap, label, float(rng.uniform(0.25, 0.8)))
