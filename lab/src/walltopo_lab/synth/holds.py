"""Procedural holds: each type is a signed-distance field, meshed in a maker's style."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Body
from walltopo_lab.synth.shapes import (
    cap,
    capsule,
    carve,
    ellipsoid,
    grid_noise,
    half_space,
    join,
    rounded_box,
)

Field = NDArray[np.float32]
HOLD_KINDS = ("jug", "crimp", "sloper", "pinch", "pocket", "foot")
STYLES = ("organic", "stone", "faceted", "smooth", "ribbed", "prism")

# Width, height, depth of an average hold of each type, metres, and the spread of its size.
SIZES = {
    "jug": (0.17, 0.125, 0.085, 0.30),
    "crimp": (0.125, 0.05, 0.033, 0.30),
    "sloper": (0.24, 0.20, 0.095, 0.40),
    "pinch": (0.085, 0.20, 0.075, 0.25),
    "pocket": (0.15, 0.145, 0.065, 0.22),
    "foot": (0.052, 0.042, 0.027, 0.35),
}


@dataclass(frozen=True, eq=False)
class _Draft:
    """A hold during modelling: its (warped) grid points, its size and its random generator."""

    points: Field
    size: tuple[float, float, float]
    rng: np.random.Generator


def _jug(d: _Draft) -> Field:
    w, h, z = d.size
    body = ellipsoid(d.points, (0, -0.05 * h, -0.15 * z), (w / 2, h / 2, 1.15 * z))
    lip = capsule(d.points, (-0.3 * w, 0.2 * h, 0.66 * z), (0.3 * w, 0.2 * h, 0.66 * z), 0.2 * z)
    body = join(body, lip, 0.35 * z)
    bend = 0.05 * h * d.rng.uniform(-1, 1)
    scoop = join(
        capsule(d.points, (-0.27 * w, 0.40 * h, 0.36 * z), (0, 0.2 * h + bend, 0.33 * z), 0.21 * z),
        capsule(d.points, (0.27 * w, 0.40 * h, 0.36 * z), (0, 0.2 * h + bend, 0.33 * z), 0.21 * z),
        0.3 * z,
    )
    above = rounded_box(d.points, (0, 0.62 * h, 0.42 * z), (0.36 * w, 0.4 * h, 0.27 * z), 0.12 * z)
    return carve(body, join(scoop, above, 0.2 * z), 0.12 * z)


def _crimp(d: _Draft) -> Field:
    w, h, z = d.size
    body = ellipsoid(d.points, (0, 0, -0.2 * z), (w / 2, 0.62 * h, 1.2 * z))
    tilt = d.rng.uniform(0.0, 0.3)
    edge = half_space(d.points, (0, 1, -tilt), 0.12 * h)
    arch = d.rng.uniform(-0.25, 0.25)
    bow = d.points[..., 0] ** 2 * np.float32(arch / w)
    return cap(body, (edge + bow).astype(np.float32), 0.004)


def _sloper(d: _Draft) -> Field:
    w, h, z = d.size
    if d.rng.random() < 0.5:
        return ellipsoid(d.points, (0, 0, -0.1 * z), (w / 2, h / 2, 1.1 * z))
    ball = ellipsoid(d.points, (0, -0.05 * h, -0.4 * z), (w / 2, 0.55 * h, 1.4 * z))
    ledge = half_space(d.points, (0, 0.75, 0.65), 0.62 * z + 0.03 * h)
    return cap(ball, ledge, 0.35 * z)


def _pinch(d: _Draft) -> Field:
    w, h, z = d.size
    body = rounded_box(d.points, (0, 0, 0.2 * z), (w / 2, h / 2, 0.8 * z), 0.42 * w)
    waist = d.rng.uniform(0.12, 0.3) * w
    for side in (-1, 1):
        tool = ellipsoid(
            d.points, (side * (w * 0.5 + 0.5 * w - waist), 0, 0.55 * z), (w / 2, 0.42 * h, 0.62 * z)
        )
        body = carve(body, tool, 0.1 * w)
    return body


def _pocket(d: _Draft) -> Field:
    w, h, z = d.size
    body = ellipsoid(d.points, (0, 0, -0.15 * z), (w / 2, h / 2, 1.15 * z))
    fingers = int(d.rng.integers(1, 4))
    reach = 0.011 * (fingers - 1) * 0.9
    y = 0.16 * h
    hole = capsule(d.points, (-reach, y + 0.012, 1.3 * z), (-reach, y - 0.012, 0.3 * z), 0.015)
    other = capsule(d.points, (reach, y + 0.012, 1.3 * z), (reach, y - 0.012, 0.3 * z), 0.015)
    return carve(body, join(hole, other, 0.02), 0.012)


def _foot(d: _Draft) -> Field:
    w, h, z = d.size
    if d.rng.random() < 0.5:
        return ellipsoid(d.points, (0, 0, -0.1 * z), (w / 2, h / 2, 1.1 * z))
    body = rounded_box(d.points, (0, 0, 0.2 * z), (w / 2, h / 2, 0.8 * z), 0.25 * h)
    return cap(body, half_space(d.points, (0, 0.7, 0.7), 0.55 * z), 0.006)


_KINDS: dict[str, Callable[[_Draft], Field]] = {
    "jug": _jug,
    "crimp": _crimp,
    "sloper": _sloper,
    "pinch": _pinch,
    "pocket": _pocket,
    "foot": _foot,
}


def _apply_style(field: Field, d: _Draft, style: str) -> Field:
    """Apply the maker's style: lumps, stone, planes, ribs or nothing."""
    w, h, z = d.size
    big = (w + h) / 2
    if style in ("organic", "stone"):
        lumps = grid_noise(field.shape, 4, d.rng) * np.float32(0.022 * big)
        field = field + lumps
    if style == "stone":
        field = field + grid_noise(field.shape, 13, d.rng) * np.float32(0.007 * big)
    elif style == "faceted":
        for _ in range(int(d.rng.integers(6, 12))):
            n = d.rng.normal(size=3) * (1 / w, 1 / h, 0.6 / z)
            n[2] = abs(n[2])
            n /= np.linalg.norm(n)
            support = np.sqrt(((n * (w / 2, h / 2, z)) ** 2).sum())
            field = cap(field, half_space(d.points, n, d.rng.uniform(0.74, 0.93) * support), 0.003)
    elif style == "prism":
        sides = int(d.rng.integers(3, 6))
        start = d.rng.uniform(0, 2 * np.pi)
        for k in range(sides):
            angle = start + 2 * np.pi * k / sides + d.rng.normal(0, 0.15)
            n = np.array([np.cos(angle) / w, np.sin(angle) / h, d.rng.uniform(0.15, 0.5) / z])
            n /= np.linalg.norm(n)
            support = np.sqrt(((n * (w / 2, h / 2, z)) ** 2).sum())
            field = cap(field, half_space(d.points, n, d.rng.uniform(0.62, 0.8) * support), 0.004)
    elif style == "ribbed":
        angle = d.rng.uniform(0, np.pi)
        along = d.points[..., 0] * np.cos(angle) + d.points[..., 1] * np.sin(angle)
        field = field + np.float32(0.011 * big) * np.sin(along * np.float32(2 * np.pi / 0.026))
    return np.asarray(field, dtype=np.float32)


def _grid(size: tuple[float, float, float], voxel: float) -> tuple[Field, Field]:
    """Return grid points (X, Y, Z, 3) around a hold and the grid's origin (3,)."""
    w, h, z = size
    margin = 3 * voxel + 0.16 * max(w, h)
    low = np.array([-w / 2 - margin, -h / 2 - margin, -2.5 * voxel], np.float32)
    high = np.array([w / 2 + margin, h / 2 + margin, 1.25 * z + margin], np.float32)
    counts = np.ceil((high - low) / voxel).astype(int) + 1
    axes = [low[k] + voxel * np.arange(counts[k], dtype=np.float32) for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).astype(np.float32), low


def _warp_space(points: Field, size: tuple[float, float, float], rng: np.random.Generator) -> Field:
    """Bend, taper and shear space slightly, so that no two holds share an outline."""
    w, h, _ = size
    bend, taper, shear = rng.normal(0, (0.22, 0.16, 0.12))
    x, y = points[..., 0] / np.float32(w), points[..., 1] / np.float32(h)
    warped = points.copy()
    warped[..., 1] += np.float32(bend * h) * (x * x - np.float32(0.08))
    warped[..., 0] *= 1 + np.float32(taper) * np.clip(y, -0.6, 0.6)
    warped[..., 0] += np.float32(shear * w) * y
    return warped


def make_hold(
    kind: str, style: str, rng: np.random.Generator, scale: float = 1.0, detail: float = 1.0
) -> Body:
    """Return one procedural hold.

    Parameters
    ----------
    kind : one of `HOLD_KINDS`.
    style : one of `STYLES`, the maker's family of shapes.
    rng : random generator of all variation.
    scale : size relative to real holds.
    detail : 1 gives triangles of 2 to 8 mm, 2 gives half that size.
    """
    from skimage.measure import marching_cubes

    w, h, z, spread = SIZES[kind]
    grow = scale * float(np.exp(rng.normal(0, spread * 0.6)))
    stretch = np.exp(rng.normal(0, 0.1, 3))
    size = (w * grow * stretch[0], h * grow * stretch[1], z * grow * stretch[2])
    voxel = float(np.clip(max(size) / 32, 0.0021, 0.0075)) / detail
    points, low = _grid(size, voxel)
    draft = _Draft(_warp_space(points, size, rng), size, rng)
    field = _apply_style(_KINDS[kind](draft), draft, style)
    field, bolt = _bore_bolt(field, draft, kind)
    # Sink the back slightly into the wall, so that no light shows under the hold.
    field = np.maximum(field, -points[..., 2] - np.float32(0.8 * voxel))
    field[0], field[-1], field[:, 0], field[:, -1] = 1, 1, 1, 1
    field[:, :, 0] = np.maximum(field[:, :, 0], np.float32(0.3 * voxel))
    field[:, :, -1] = 1
    vertices, faces, slopes, _ = marching_cubes(field, 0.0, spacing=(voxel,) * 3)
    return _finish_surface(vertices + low, faces, slopes, size, bolt, rng)


def _bore_bolt(
    field: Field, d: _Draft, kind: str
) -> tuple[Field, tuple[float, float, float, float]]:
    """Bore the bolt's hole; return the field and the bolt as (x, y, radius, bottom z)."""
    _, h, z = d.size
    y = {"jug": -0.05 * h, "pocket": -0.22 * h, "crimp": -0.12 * h}.get(kind, 0.0)
    radius = 0.0095 if kind != "foot" else 0.0055
    bottom = 0.45 * z
    bore = capsule(d.points, (0, y, bottom + radius), (0, y, 3 * z), radius)
    return carve(field, bore, 0.002), (0.0, y, radius, bottom)


def _finish_surface(
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    slopes: NDArray[np.float32],
    size: tuple[float, float, float],
    bolt: tuple[float, float, float, float],
    rng: np.random.Generator,
) -> Body:
    """Orient the triangles and compute chalk, gloss and steel at the vertices."""
    h = size[1]
    keep, triangles = _largest_piece(len(vertices), faces.astype(np.int32))
    points = vertices[keep].astype(np.float64)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum()
    if volume < 0:
        triangles = triangles[:, ::-1].copy()
    unit = _smooth_normals(vertex_normals(points, triangles), slopes[keep])
    up = np.clip(unit[:, 1] * 0.8 + unit[:, 2] * 0.35, 0, 1)
    front = np.clip((points[:, 1] / h + 0.35) * 1.3, 0, 1)
    chalk = (up * front).astype(np.float32)
    gloss = np.zeros(len(points), np.float32)
    if rng.random() < 0.3:  # a dual texture: one part of the hold is slick
        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        cut = rng.uniform(-0.1, 0.2) * max(size)
        gloss = np.clip(((points @ n) - cut) / 0.004 + 0.5, 0, 1).astype(np.float32)
    x, y, radius, bottom = bolt
    inside = np.hypot(points[:, 0] - x, points[:, 1] - y) < radius * 1.05
    steel = (inside & (points[:, 2] < bottom + radius * 0.9)).astype(np.float32)
    reach = float(np.abs(points[:, :2]).max())
    return Body(points, triangles, unit, chalk, gloss, steel, reach)


def _smooth_normals(unit: NDArray[np.float64], slopes: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the mesh normals blended with the field's slopes, which lack the grid's facets."""
    toward = np.sign((unit * slopes).sum(axis=1, keepdims=True))
    mixed = unit + 3.0 * toward * slopes
    return np.asarray(mixed / np.maximum(np.linalg.norm(mixed, axis=1, keepdims=True), 1e-12))


def _largest_piece(
    count: int, triangles: NDArray[np.int32]
) -> tuple[NDArray[np.bool_], NDArray[np.int32]]:
    """Return the vertices to keep and their triangles, without fragments that bores cut off."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    ones = np.ones(len(pairs), np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    pieces, piece = connected_components(graph, directed=False)
    keep = piece == np.bincount(piece).argmax()
    if pieces == 1:
        return keep, triangles
    renumber = np.cumsum(keep).astype(np.int32) - 1
    return keep, renumber[triangles[keep[triangles[:, 0]]]]


def vertex_normals(
    points: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.float64]:
    """Return (V, 3) area-weighted unit normals; z if the triangles have no area or cancel out."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    summed = np.stack(
        [
            sum(
                np.bincount(triangles[:, corner], cross[:, axis], len(points))
                for corner in range(3)
            )
            for axis in range(3)
        ],
        axis=1,
    )
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    return np.where(length > 0, summed / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
