"""Map photos without a known focal length from several guesses; keep what explains them best.

From a guess that is far off, few photos that overlap little end in a consistent but wrong model,
often with an absurd lens.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.jobs import DEFAULT_FOCAL, ColmapJob, MappingResult

# Shares of the longer side: a phone's main camera, its wide lens, one between them, its tele lens.
FOCALS = (DEFAULT_FOCAL, 0.4, 0.55, 1.4)
_MIN_FOCAL, _MAX_FOCAL = 0.2, 5.0  # shares of the longer side
_MAX_DISTORTION = 1.0


@dataclass(frozen=True)
class Mapped:
    """A mapping; without a usable model it is empty.

    Parameters
    ----------
    centres : camera centre (3,) of each registered photo, by its name.
    observations : number of times that a photo shows a point.
    """

    result: MappingResult
    centres: Mapping[str, NDArray[np.float64]]
    observations: int = 0


def focals_of(job: ColmapJob) -> tuple[float, ...]:
    """Return the guesses for a job's cameras; one that changes nothing if all are known."""
    return (0.0,) if all(camera.prior for camera in job.cameras) else FOCALS


def best_mapping(
    map_from: Callable[[float], Mapped], focals: Sequence[float], wanted: int
) -> tuple[Mapped, float]:
    """Return the first mapping that registers all photos, else the one of most observations.

    Parameters
    ----------
    map_from : maps from a guess.
    wanted : number of photos.

    Returns
    -------
    The mapping and its guess.
    """
    found: list[tuple[Mapped, float]] = []
    for focal in focals:
        found.append((map_from(focal), focal))
        if len(found[-1][0].centres) == wanted:
            return found[-1]
    return max(found, key=lambda one: one[0].observations)


def has_doubtful_lens(model: Any, job: ColmapJob) -> bool:
    """Return whether a lens of unknown focal length came out as none that phones have, or from two
    photos of more: two views of a flat wall fit any focal length.

    Parameters
    ----------
    model : `pycolmap.Reconstruction`.
    """
    unknown = {k: entry for k, entry in enumerate(job.cameras, start=1) if not entry.prior}
    if unknown.keys() & model.cameras.keys() and model.num_reg_images() < min(3, len(job.images)):
        return True
    return any(_is_absurd(model.cameras[k]) for k in unknown if k in model.cameras)


def _is_absurd(camera: Any) -> bool:
    focal = camera.mean_focal_length() / max(camera.width, camera.height)
    distortion = [abs(camera.params[k]) for k in camera.extra_params_idxs()]
    return not _MIN_FOCAL <= focal <= _MAX_FOCAL or max(distortion, default=0.0) > _MAX_DISTORTION
