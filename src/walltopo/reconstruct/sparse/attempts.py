"""Retry the mapping with other features if photos stay unregistered; explain the failures.

The first strategy, *sift*, is fast and sufficient on most walls. If photos stay unregistered,
*closer* doubles them before SIFT, which finds four times as many features, including weaker ones;
then *learned* adds the features of a network (XFeat), which finds some on smooth walls, but can
match repeated structure wrongly (`lookalikes`); *larger* adds those of a larger network (ALIKED),
if its package is installed. Very few photos skip *closer*. All process only the unregistered photos
and their best-matching neighbours; other features are reused.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse.feature_cache import find_features, seal_features
from walltopo.reconstruct.sparse.jobs import ColmapJob, KnownFeatures, LearnedTask, Sift
from walltopo.reconstruct.sparse.larger_network import larger_network_files
from walltopo.reconstruct.sparse.lookalikes import models_agree
from walltopo.scans.colmap_model import open_model

T = TypeVar("T")
Floats = NDArray[np.float64]

_NEIGHBOURS = 8  # photos processed again with each unregistered one


@dataclass(frozen=True)
class Attempt(Generic[T]):
    """The result of one mapping attempt.

    Parameters
    ----------
    strategy : "sift", "closer", "learned" or "larger".
    job : job that found the features.
    result : result of the mapping.
    registered : maps each registered photo's name to its camera centre (3,).
    tried : all strategies that ran, in order.
    """

    strategy: str
    job: ColmapJob
    result: T
    registered: Mapping[str, Floats]
    tried: tuple[str, ...] = ()


def best_attempt(
    job: ColmapJob,
    settings: SparseSettings,
    photos: Path,
    progress: Progress,
    map_job: Callable[[ColmapJob], tuple[T, Mapping[str, Floats]]],
    wanted: Collection[str],
    is_connected: Callable[[T, Collection[str]], bool],
) -> Attempt[T]:
    """Return the first attempt that registers all wanted photos, or the one that registers most.

    An attempt is rejected if its cameras contradict the best previous attempt, or if its new photos
    are not connected to that attempt's photos: repeated structure can be matched consistently but
    wrongly.

    Parameters
    ----------
    job : job of the first attempt.
    photos : folder of the photos; its hash is part of the cache key.
    map_job : maps a job's features; returns the result and the registered camera centres.
    wanted : image names of the photos to register.
    is_connected : whether a mapping's photos are connected to the photos with the given names.

    Raises
    ------
    StageError : COLMAP or `map_job` failed in any attempt.
    """

    def attempt(strategy: str, job: ColmapJob) -> Attempt[T]:
        find_features(job, photos, progress)
        result, registered = map_job(job)
        return Attempt(strategy, job, result, registered)

    best = attempt("sift", job)
    tried = [best]
    for strategy, make_job in further_strategies(settings, len(job.images)):
        unregistered = set(wanted) - best.registered.keys()
        if not unregistered:
            break
        names = _with_neighbours(best.job, unregistered, _STEPS[strategy])
        progress.note(
            f"{len(unregistered)} of {len(wanted)} photos are not registered: retrying {len(names)}"
            f" photos ({_DESCRIPTIONS[strategy]})"
        )
        tried.append(attempt(strategy, make_job(best.job, names)))
        found = tried[-1]
        if len(found.registered) <= len(best.registered):
            continue
        if not models_agree(best.registered, found.registered):
            progress.note(
                "the retry contradicts the cameras of the previous attempt and is discarded"
            )
        elif not is_connected(found.result, best.registered):
            progress.note(
                "the retry joins photos of places that merely look alike and is discarded"
            )
        else:
            best = found
    for one in tried:
        seal_features(Path(one.job.database))
    return dataclasses.replace(best, tried=tuple(one.strategy for one in tried))


# A learned feature becomes a point only where two neighbours of the photo have it, too.
_STEPS = {"closer": 1, "learned": 2, "larger": 2}
_DESCRIPTIONS = {
    "closer": "doubled in size",
    "learned": "by a network",
    "larger": "by a larger network",
}


# The network matches all pairs, so more photos cost it much more than doubling them does.
_VERY_FEW_PHOTOS = 8


def further_strategies(
    settings: SparseSettings, photos: int
) -> Iterator[tuple[str, Callable[[ColmapJob, set[str]], ColmapJob]]]:
    """Yield the name of each further strategy and the function that makes its job.

    Very few photos skip `closer`: on six generated smooth walls of 5 and 6 photos, it registered
    all photos of one set in twelve, and `learned` placed as many cameras right without it, in .75
    of the time.
    """
    if settings.features == "auto":
        if settings.first_octave > -1 and photos > _VERY_FEW_PHOTOS:
            yield "closer", _closer
        yield "learned", _learned
        if larger_network_files() is not None:
            yield "larger", larger_job


def _closer(job: ColmapJob, names: set[str]) -> ColmapJob:
    """Return the job with SIFT on the doubled photos of `names`; other features are reused."""
    others = {entry.name: entry.name for entry in job.images if entry.name not in names}
    return replace(
        job,
        database=_database_for(job, "closer"),
        sift=Sift(2 * job.sift.max_features, -1),
        known_features=KnownFeatures(job.database, others, matches=True),
    )


_FEW_PHOTOS = 20
_LARGER_POINTS = 1024  # a pair takes 1 CPU second, with 2,048 points 3


def _learned(job: ColmapJob, names: set[str]) -> ColmapJob:
    """Return the job that adds learned features for `names` to all features so far.

    All pairs of few photos are matched, with more features: on nine generated walls of 5 to 7
    photos, 2,000 and 3,000 place as many cameras (84 and 83 of 91; 2 and 5 wrongly), 2,000 in .6
    of the time. On three of the walls 1,500 place one less.
    """
    everything = {entry.name: entry.name for entry in job.images}
    images = tuple(k for k, entry in enumerate(job.images, start=1) if entry.name in names)
    few = len(images) <= _FEW_PHOTOS
    return replace(
        job,
        database=_database_for(job, "learned"),
        pairing=None,
        known_features=KnownFeatures(job.database, everything, matches=True),
        learned=LearnedTask(
            images, points=2000 if few else 1600, partners=_FEW_PHOTOS if few else 8
        ),
    )


def larger_job(job: ColmapJob, names: set[str]) -> ColmapJob:
    """Return the job that adds features of the larger network for `names` to all so far."""
    made = _learned(job, names)
    assert made.learned is not None
    return replace(
        made,
        database=_database_for(job, "larger"),
        learned=replace(made.learned, points=_LARGER_POINTS, larger=True),
    )


def _database_for(job: ColmapJob, name: str) -> str:
    """Return the database path of another attempt, in a folder beside that of the first."""
    first = Path(job.database).parent
    return str(first.with_name(f"{first.name.partition('.')[0]}.{name}") / "features.db")


def _with_neighbours(job: ColmapJob, unregistered: set[str], steps: int) -> set[str]:
    """Return the names, and the photos that share most matches with them.

    Return all photos if more than a third is unregistered, or if one has no match: a photo without
    matches may belong anywhere.

    Parameters
    ----------
    steps : 2 adds the neighbours of the neighbours.
    """
    from walltopo.geometry.colmap import pycolmap

    names = [entry.name for entry in job.images]
    shared: dict[int, list[tuple[int, int]]] = {k: [] for k in range(1, len(names) + 1)}
    with pycolmap.Database.open(job.database) as db:
        for pair, count in zip(*db.read_num_matches(), strict=True):
            if count:
                a, b = pycolmap.pair_id_to_image_pair(pair)
                shared[a].append((-count, b))
                shared[b].append((-count, a))
    chosen = {k for k, name in enumerate(names, start=1) if name in unregistered}
    if 3 * len(chosen) > len(names) or not all(shared[k] for k in chosen):
        return set(names)
    for _ in range(steps):
        chosen |= {b for a in chosen for _, b in sorted(shared[a])[:_NEIGHBOURS]}
    return {names[k - 1] for k in chosen}


_FEW_FEATURES = 200


def describe_model(model: Any, photos: int) -> dict[str, Any]:
    """Return the metrics of a `pycolmap.Reconstruction` (pixels, counts)."""
    used = {image.camera_id for image in model.images.values() if image.has_pose}
    focals = [model.cameras[number].mean_focal_length() for number in sorted(used)]
    return {
        "photos": photos,
        "registered": model.num_reg_images(),
        "points": model.num_points3D(),
        "reprojection_px": round(model.compute_mean_reprojection_error(), 4),
        "track_length": round(model.compute_mean_track_length(), 3),
        "focal_px": [round(focal, 2) for focal in focals],
    }


def why_unregistered(
    database: Path, missing: Mapping[str, str], elsewhere: Mapping[str, int]
) -> dict[str, str]:
    """Explain from COLMAP's database why each missing photo is not in the model.

    Parameters
    ----------
    database : the feature database.
    missing : maps photo names to image names in the database.
    elsewhere : maps photo names to the size of the other model that holds the photo.

    Returns
    -------
    Reasons by photo name.
    """
    from walltopo.geometry.colmap import pycolmap

    if not missing:
        return {}
    reasons: dict[str, str] = {}
    with pycolmap.Database.open(database) as db:
        ids = {str(image.name): image.image_id for image in db.read_all_images()}
        linked: Counter[int] = Counter()
        for pair, count in zip(*db.read_two_view_geometry_num_inliers(), strict=True):
            if count:
                linked.update(pycolmap.pair_id_to_image_pair(pair))
        for photo, name in missing.items():
            features = db.num_keypoints_for_image(ids[name])
            reasons[photo] = _reason(features, linked[ids[name]], elsewhere.get(photo, 0))
    return reasons


def bridging_pair(
    database: Path, kept: Collection[str], group: Collection[str]
) -> tuple[str, str] | None:
    """Return the photos, one of each group, between which another photo is most likely to connect
    them: those that share most matches; None if none match.

    Parameters
    ----------
    database : the feature database; its matches include those that were not verified.
    kept, group : image names of two groups without a common model.
    """
    from walltopo.geometry.colmap import pycolmap

    with pycolmap.Database.open(database) as db:
        names = {image.image_id: str(image.name) for image in db.read_all_images()}
        best: tuple[int, tuple[str, str]] | None = None
        for pair, count in zip(*db.read_num_matches(), strict=True):
            a, b = (names[number] for number in pycolmap.pair_id_to_image_pair(pair))
            for one, other in ((a, b), (b, a)):
                if one in kept and other in group and (best is None or count > best[0]):
                    best = int(count), (one, other)
    return None if best is None or best[0] == 0 else best[1]


def other_models(models: Path, kept: Path) -> list[set[str]]:
    """Return the names of the photos of each model but the kept one, in the order of folders."""
    return [
        registered_names(folder)
        for folder in sorted(models.iterdir())
        if folder != kept and (folder / "images.bin").is_file()
    ]


def camera_centres(model: Any) -> dict[str, NDArray[np.float64]]:
    """Return the camera centre (3,) of each registered photo, by its name."""
    return {
        str(image.name): np.asarray(image.projection_center())
        for image in model.images.values()
        if image.has_pose
    }


def registered_names(path: Path) -> set[str]:
    """Return the names of the registered photos of a model folder."""
    return set(camera_centres(open_model(path)))


def _reason(features: int, linked: int, group: int) -> str:
    if features < _FEW_FEATURES:
        return f"only {features} features found: blurred, dark or a plain surface"
    if linked == 0:
        return "nothing in it matches any other photo: another place, or too little overlap"
    if group:
        return f"it belongs to a separate group of {group} photos: take photos that link the two"
    return (
        f"it matches {linked} other photo(s), but too few of the points they share are in the "
        "model: take photos between it and its neighbours"
    )
