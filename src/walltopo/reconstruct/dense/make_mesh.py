"""Make the mesh of a scan: choose a backend, run it, and guess the holes that it left."""

from __future__ import annotations

import numpy as np

from walltopo.core import Mesh
from walltopo.geometry.topology import side_lengths
from walltopo.reconstruct.dense.backend import DenseInput, open_backend
from walltopo.reconstruct.dense.colmap import has_cuda
from walltopo.reconstruct.dense.guess import guess_holes
from walltopo.reconstruct.dense.scene import Scene, median_pixel_size, meshing_box, read_scene
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet

# In an unscaled scan, lengths in the settings count a metre as this share of the scene's diagonal.
_UNSCALED_METRE = 0.1


def edge_and_unit(scene: Scene, settings: DenseSettings, metric: bool) -> tuple[float, float]:
    """Return the target edge length and the length of a settings metre, both in world units.

    In a metric scan the edge is `settings.edge_length`, but never finer than the photos show
    (half of `settings.edge_pixels` pixels, because stereo resolves about a pixel). In an unscaled
    scan the edge is `settings.edge_pixels` pixels; a metre is a tenth of the scene's diagonal.
    """
    pixel = median_pixel_size(scene)
    if metric:
        return max(settings.edge_length, 0.5 * settings.edge_pixels * pixel), 1.0
    low, high = meshing_box(scene)
    return settings.edge_pixels * pixel, _UNSCALED_METRE * float(np.linalg.norm(high - low))


def pick_backend(settings: DenseSettings) -> tuple[str, str]:
    """Return the backend for this machine and the reason of the choice.

    `auto` takes COLMAP's PatchMatch if pycolmap has CUDA and a device, else the embedded
    stereo: OpenMVS on a CPU was slower and less complete (docs/dense.md). A backend that the
    settings name is never replaced; it raises an error if the machine lacks something.
    """
    if settings.backend != "auto":
        return settings.backend, "as asked"
    if has_cuda():
        return "colmap", "pycolmap has CUDA and a device"
    return "sgm", "no CUDA for pycolmap"


def make_mesh(
    photos: PhotoSet,
    sparse: SparseModel,
    metric: bool,
    settings: DenseSettings,
    context: Context,
) -> tuple[Mesh, Metrics]:
    """Compute the mesh of the scan from its cameras and photos.

    Raises
    ------
    InputError : the settings name a backend that is not installed.
    EnvironmentLacksError, StageError : as in `DenseBackend.mesh`.
    """
    scene = read_scene(sparse.folder)
    edge, unit = edge_and_unit(scene, settings, metric)
    backend, reason = pick_backend(settings)
    context.progress.note(
        f"dense: {backend} ({reason}), edges of about {_format_length(edge, metric)}"
    )
    measured = open_backend(backend, settings).mesh(
        DenseInput(photos, sparse, scene, edge, unit, context.cache, context.progress)
    )
    length = float(np.median(side_lengths(measured)))
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
            "seen_through": guesses.seen_through,
            "edge_length": round(length, 6),
            "metric": metric,
        },
    )


def _format_length(value: float, metric: bool) -> str:
    return f"{value * 1000:.1f} mm" if metric else f"{value:.4g} units"
