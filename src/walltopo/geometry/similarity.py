"""Fit similarity transforms, mean rotations and planes, in closed form and robustly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Similarity:
    """The transform x_to = scale * rotation @ x_from + translation.

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
        """Transform points (..., 3) of `from` to `to`."""
        return self.scale * (points @ self.rotation.T) + self.translation

    def mesh(self, mesh: Mesh) -> Mesh:
        """Transform a mesh of `from` to `to`."""
        return Mesh(self.apply(mesh.vertices), mesh.faces, mesh.vertex_colours, mesh.guessed)

    def inverse(self) -> Similarity:
        """Return the inverse transform."""
        rotation = self.rotation.T
        return Similarity(1 / self.scale, rotation, -(rotation @ self.translation) / self.scale)

    def after(self, first: Similarity) -> Similarity:
        """Return the transform that applies `first`, then this one."""
        return Similarity(
            self.scale * first.scale,
            self.rotation @ first.rotation,
            self.apply(first.translation),
        )


def fit_similarity(source: Floats, target: Floats) -> Similarity:
    """Fit a similarity from `source` (n, 3) to `target` (n, 3), n >= 3, by least squares.

    Source: Umeyama, "Least-squares estimation of transformation parameters between two point
    patterns" (PAMI 1991).

    Raises
    ------
    InputError : fewer than 3 points, or all points are collinear or coincide.
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
    """Fit a similarity by RANSAC over triples, then by least squares on the inliers.

    Parameters
    ----------
    source, target : (n, 3) float.
    tolerance : maximum residual of an inlier, units of `target`.
    seed : random seed of the triples.
    rounds : number of triples.

    Returns
    -------
    The transform and (n,) bool, the inliers.

    Raises
    ------
    InputError : fewer than three inliers.
    """
    rng = np.random.default_rng(seed)
    best = np.zeros(len(source), dtype=np.bool_)
    for _ in range(rounds if len(source) > 3 else 1):
        triple = rng.choice(len(source), 3, replace=False) if len(source) > 3 else np.arange(3)
        try:
            inliers = _pairs_within(
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
        inliers = _pairs_within(fit, source, target, tolerance)
        if inliers.sum() < 3 or (inliers == best).all():
            break
        best = inliers
    return fit, best


def _pairs_within(
    fit: Similarity, source: Floats, target: Floats, tolerance: float
) -> NDArray[np.bool_]:
    """Return (n,) whether the residual of a pair is at most the tolerance."""
    return np.linalg.norm(fit.apply(source) - target, axis=1) <= tolerance


def mean_rotation(rotations: Sequence[Floats] | Floats) -> Floats:
    """Return the chordal mean: the rotation with the least sum of squared matrix differences.

    Source: Hartley et al., "Rotation Averaging" (IJCV 2013), the chordal L2 mean.
    """
    return nearest_rotation(np.sum(np.asarray(rotations), axis=0))


def nearest_rotation(matrix: Floats) -> Floats:
    """Return the rotation (3, 3) nearest to a matrix (3, 3) in the Frobenius norm.

    For `target.T @ source` of centred points (n, 3), it is the least squares rotation from `source`
    to `target` (Kabsch, Acta Crystallographica A32, 1976).
    """
    u, _, vt = np.linalg.svd(matrix)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    return (u * signs) @ vt


def fit_plane(points: Floats) -> tuple[Floats, float]:
    """Fit a plane to points (n, 3) by total least squares; return normal (3,) and offset =
    normal·x.

    The sign of the normal is arbitrary.
    """
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre, full_matrices=False)[2][2]
    return normal, float(normal @ centre)


def plane_axes(normal: Floats) -> Floats:
    """Return (2, 3) unit vectors across a normal: to the right and up, seen from the front."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(normal, right)])


def rotation_with_z(up: Floats, ahead: Floats) -> Floats:
    """Return the rotation whose rows are a frame's axes, z = `up` and x near `ahead`."""
    z = up / np.linalg.norm(up)
    x = ahead - (ahead @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def fit_poses(source: Floats, target: Floats) -> Similarity:
    """Fit the similarity between the frames of cameras that are posed in both, robustly.

    Rotations are averaged, so cameras on one line or two cameras suffice. The scale is the median
    over pairs of cameras, then a least squares fit of the cameras that agree.

    Parameters
    ----------
    source, target : (n, 3, 4) float, cam_from_world of the same cameras in both frames.

    Raises
    ------
    InputError : fewer than two cameras, or all in one place.
    """
    if len(source) < 2 or len(source) != len(target):
        raise InputError(f"poses: 2 or more cameras in both frames, got {len(source)}")
    a, b = _camera_centres(source), _camera_centres(target)
    turns = np.einsum("nki,nkj->nij", target[:, :, :3], source[:, :, :3])
    rotation = mean_rotation(turns)
    for _ in range(3):  # cameras that are far from the mean do not count
        off = np.linalg.norm(turns - rotation, axis=(1, 2))
        rotation = mean_rotation(turns[off <= 2 * np.median(off) + 1e-12])
    i, j = np.triu_indices(len(a), 1)
    apart, apart_b = (np.linalg.norm(c[i] - c[j], axis=1) for c in (a, b))
    wide = apart >= np.median(apart)
    if not apart[wide].max() > 0 or not apart_b[wide].max() > 0:
        raise InputError("poses: all cameras are in one place")
    scale = float(np.median(apart_b[wide] / apart[wide]))
    turned = a @ rotation.T
    away = np.median(b - scale * turned, axis=0)
    off = np.linalg.norm(scale * turned + away - b, axis=1)
    near = off <= 3 * np.median(off) + 1e-12
    p, q = turned[near] - turned[near].mean(axis=0), b[near] - b[near].mean(axis=0)
    if (p**2).sum() > 0 and (p * q).sum() > 0:
        scale = float((p * q).sum() / (p**2).sum())
    return Similarity(scale, rotation, b[near].mean(axis=0) - scale * turned[near].mean(axis=0))


def _camera_centres(poses: Floats) -> Floats:
    """Return (n, 3) the centres of cameras posed by cam_from_world (n, 3, 4)."""
    return -np.einsum("nki,nk->ni", poses[:, :, :3], poses[:, :, 3])
