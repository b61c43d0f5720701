"""Similarity transforms, mean rotations and planes: closed forms and their robust versions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Similarity:
    """x_to = scale * rotation @ x_from + translation.

    Parameters
    ----------
    scale : > 0, units of `to` per unit of `from`.
    rotation : (3, 3) float, determinant +1.
    translation : (3,) float, units of `to`.
    """

    scale: float
    rotation: Floats
    translation: Floats

    def apply(self, points: Floats) -> Floats:
        """Points (..., 3) of `from` in `to`."""
        return self.scale * (points @ self.rotation.T) + self.translation

    def mesh(self, mesh: Mesh) -> Mesh:
        """A mesh of `from` in `to`."""
        return Mesh(self.apply(mesh.vertices), mesh.faces, mesh.vertex_colours, mesh.guessed)

    def inverse(self) -> Similarity:
        """The way back."""
        rotation = self.rotation.T
        return Similarity(1 / self.scale, rotation, -(rotation @ self.translation) / self.scale)

    def after(self, first: Similarity) -> Similarity:
        """The transform that does `first`, then this."""
        return Similarity(
            self.scale * first.scale,
            self.rotation @ first.rotation,
            self.apply(first.translation),
        )


def fit_similarity(source: Floats, target: Floats) -> Similarity:
    """Least squares similarity from `source` (n, 3) to `target` (n, 3), n >= 3 not on one line.

    Source: Umeyama, "Least-squares estimation of transformation parameters between two point
    patterns" (PAMI 1991).

    Raises
    ------
    InputError : fewer than 3 points, or all on one line or spot.
    """
    source, target = np.asarray(source, float), np.asarray(target, float)
    if source.shape != target.shape or len(source) < 3:
        raise InputError(f"similarity: 3 or more pairs of points, got {len(source)}")
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, singular, vt = np.linalg.svd(b.T @ a)
    if singular[1] <= 1e-9 * max(singular[0], 1e-300):
        raise InputError("similarity: the points lie on one line")
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * signs) @ vt
    scale = float((singular * signs).sum() / (a**2).sum())
    return Similarity(scale, rotation, target.mean(axis=0) - scale * rotation @ source.mean(axis=0))


def fit_similarity_robust(
    source: Floats, target: Floats, tolerance: float, seed: int = 0, rounds: int = 500
) -> tuple[Similarity, NDArray[np.bool_]]:
    """RANSAC over triples, then least squares on the pairs within `tolerance`.

    Parameters
    ----------
    source, target : (n, 3) float.
    tolerance : largest residual of an inlier, units of `target`.
    seed : of the triples.

    Returns
    -------
    The transform and (n,) bool, which pairs it rests on.

    Raises
    ------
    InputError : no three pairs agree.
    """
    rng = np.random.default_rng(seed)
    best = np.zeros(len(source), dtype=np.bool_)
    for _ in range(rounds if len(source) > 3 else 1):
        triple = rng.choice(len(source), 3, replace=False) if len(source) > 3 else np.arange(3)
        try:
            inliers = _within(
                fit_similarity(source[triple], target[triple]), source, target, tolerance
            )
        except InputError:
            continue
        if inliers.sum() > best.sum():
            best = inliers
            if best.all():
                break
    if best.sum() < 3:
        raise InputError(f"similarity: no three of {len(source)} points agree")
    for _ in range(3):
        fit = fit_similarity(source[best], target[best])
        inliers = _within(fit, source, target, tolerance)
        if inliers.sum() < 3 or (inliers == best).all():
            break
        best = inliers
    return fit, best


def _within(fit: Similarity, source: Floats, target: Floats, tolerance: float) -> NDArray[np.bool_]:
    return np.linalg.norm(fit.apply(source) - target, axis=1) <= tolerance


def mean_rotation(rotations: Sequence[Floats] | Floats) -> Floats:
    """The chordal mean: the rotation with the least sum of squared matrix differences.

    Source: Hartley et al., "Rotation Averaging" (IJCV 2013), the chordal L2 mean.
    """
    u, _, vt = np.linalg.svd(np.sum(np.asarray(rotations), axis=0))
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    return (u * signs) @ vt


def fit_plane(points: Floats) -> tuple[Floats, float]:
    """Total least squares plane of points (n, 3): unit normal (3,) and offset, normal·x = offset.

    The sign of the normal is arbitrary.
    """
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre, full_matrices=False)[2][2]
    return normal, float(normal @ centre)


def rotation_with_z(up: Floats, ahead: Floats) -> Floats:
    """Rows are the axes of a frame with z = `up` and x = `ahead` made perpendicular to it."""
    z = up / np.linalg.norm(up)
    x = ahead - (ahead @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])
