"""The dense stage: choose a backend, make the mesh, write it."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import numpy as np

from walltopo.core import Mesh
from walltopo.reconstruct.dense.external import colmap_mesh, has_cuda, openmvs_mesh
from walltopo.reconstruct.dense.guess import guess_holes
from walltopo.reconstruct.dense.scene import (
    Scene,
    ground_sampling,
    preview_mesh,
    read_scene,
    surroundings,
)
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.reconstruct.dense.sgm import sgm_mesh
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet

# In an unscaled scan this share of the scene's diagonal stands for a metre in settings of size.
_UNSCALED_METRE = 0.1


def edge_and_unit(scene: Scene, settings: DenseSettings, metric: bool) -> tuple[float, float]:
    """Edge length to aim for and the length that settings call a metre, both in world units.

    In a metric scan the edge is `settings.edge_length`, but never finer than the photos show
    (`settings.edge_pixels` pixels, halved, because stereo resolves about a pixel). In an unscaled
    scan it is `settings.edge_pixels` pixels, and a metre is a tenth of the scene's diagonal.
    """
    pixel = ground_sampling(scene)
    if metric:
        return max(settings.edge_length, 0.5 * settings.edge_pixels * pixel), 1.0
    low, high = surroundings(scene)
    return settings.edge_pixels * pixel, _UNSCALED_METRE * float(np.linalg.norm(high - low))


def pick_backend(settings: DenseSettings) -> tuple[str, str]:
    """The backend to use and why, from what this machine has.

    `auto` takes COLMAP's PatchMatch where pycolmap has CUDA and a device, else the embedded
    stereo: OpenMVS on a CPU was slower and less complete (docs/dense.md). A backend asked for by
    name is not replaced: it says itself what it lacks.
    """
    if settings.backend != "auto":
        return settings.backend, "as asked"
    if has_cuda():
        return "colmap", "pycolmap has CUDA and a device"
    return "sgm", "no CUDA for pycolmap"


def _mesh(
    photos: PhotoSet,
    sparse: SparseModel,
    scene: Scene,
    backend: str,
    settings: DenseSettings,
    edge: float,
    unit: float,
    context: Context,
) -> Mesh:
    """Run one backend."""
    if backend == "sgm":
        load, progress = photos.read_grey, context.progress
        return sgm_mesh(scene, load, settings, edge, unit, progress, context.cache)
    if backend == "sparse":
        return preview_mesh(scene, settings, edge, unit, context.progress)
    other = colmap_mesh if backend == "colmap" else openmvs_mesh
    work = Path(tempfile.mkdtemp(prefix=f"{backend}-", dir=context.cache))
    mesh = other(sparse.folder, photos.folder, work, settings, edge, unit, context.progress)
    # Kept after an error, for its logs.
    shutil.rmtree(work)
    return mesh


def make_mesh(
    photos: PhotoSet,
    sparse: SparseModel,
    metric: bool,
    settings: DenseSettings,
    context: Context,
) -> tuple[Mesh, Metrics]:
    """The mesh of the scan, from its cameras and photos."""
    scene = read_scene(sparse.folder)
    edge, unit = edge_and_unit(scene, settings, metric)
    backend, reason = pick_backend(settings)
    context.progress.note(f"dense: {backend} ({reason}), edges of about {_length(edge, metric)}")
    measured = _mesh(photos, sparse, scene, backend, settings, edge, unit, context)
    sides = measured.vertices[measured.faces] - measured.vertices[np.roll(measured.faces, -1, 1)]
    length = float(np.median(np.linalg.norm(sides, axis=2)))
    largest = settings.max_guess * unit
    guesses = guess_holes(measured, scene, largest, length, context.progress)
    mesh = guesses.mesh
    return (
        mesh,
        {
            "backend": backend,
            "reason": reason,
            "vertices": len(mesh.vertices),
            "faces": len(mesh.faces),
            "area": round(float(mesh.areas[mesh.measured].sum()), 3),
            "guessed_area": round(float(mesh.areas[~mesh.measured].sum()), 3),
            "guessed_holes": guesses.spanned,
            "seen_through": guesses.looked_through,
            "edge_length": round(length, 6),
            "metric": metric,
        },
    )


def _length(value: float, metric: bool) -> str:
    return f"{value * 1000:.1f} mm" if metric else f"{value:.4g} units"
