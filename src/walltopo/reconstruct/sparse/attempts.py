"""Photos that stay out of the model are looked at again, by other means.

The first attempt is SIFT on the photo as it is: quick, and enough on most walls. Where photos
stay out, *closer* doubles them first, which finds four times as many features, weaker ones too. If
asked for, *learned* adds features of a network where some still stay out: it finds them on smooth
walls and matches by what is around them, also where that only looks alike. Both look only at the
photos that stay out and those that match them most; what was found of the others is taken over.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, Progress
from walltopo.geometry.similarity import fit_similarity
from walltopo.reconstruct.sparse.feature_cache import find_features, seal_features
from walltopo.reconstruct.sparse.jobs import Job, KnownFeatures, Learned, Sift
from walltopo.reconstruct.sparse.settings import SparseSettings

T = TypeVar("T")
Floats = NDArray[np.float64]

_NEIGHBOURS = 8  # photos that are looked at again with each one that stays out
_POINTS = 1600  # learned features of a photo
_PARTNERS = 8  # photos that each is matched with by the network
_SHARED = 4  # photos of two models that tell whether these agree
_ALIKE = 0.05  # of the cameras' extent


@dataclass(frozen=True)
class Attempt(Generic[T]):
    """What an attempt made.

    Parameters
    ----------
    means : "sift", "closer" or "learned".
    job : that found its features.
    made : of the mapping.
    registered : name of each photo in it, and where its camera is, (3,).
    """

    means: str
    job: Job
    made: T
    registered: Mapping[str, Floats]


def best_attempt(
    job: Job,
    settings: SparseSettings,
    photos: Path,
    progress: Progress,
    mapped: Callable[[Job], tuple[T, Mapping[str, Floats]]],
    wanted: Collection[str],
    tied: Callable[[T, Collection[str]], bool],
) -> Attempt[T]:
    """The first attempt that registers all wanted photos, or the one that registers most.

    One whose cameras contradict those of the attempt before, or whose new photos are not tied to
    them, is no candidate: what looks alike can be matched in a way that fits and is wrong.

    Parameters
    ----------
    job : of the first attempt.
    photos : the folder whose content the features follow from.
    mapped : maps from a job's features; gives what it made and the cameras that it registered.
    wanted : names of photos, as the job has them.
    tied : whether the photos of a mapping hang together with those of the names.

    Raises
    ------
    StageError : COLMAP failed, or `mapped` did, in the first attempt as in the others.
    """

    def attempt(means: str, job: Job) -> Attempt[T]:
        find_features(job, photos, progress)
        made, registered = mapped(job)
        return Attempt(means, job, made, registered)

    best = attempt("learned" if settings.features == "xfeat" else "sift", job)
    tried = [best]
    for means, closer in _others(settings):
        out = set(wanted) - best.registered.keys()
        if not out:
            break
        names = _with_neighbours(best.job, out)
        progress.note(
            f"{len(out)} of {len(wanted)} photos stay out: {len(names)} are looked at again"
            f" ({_WORDS[means]})"
        )
        tried.append(attempt(means, closer(best.job, names)))
        found = tried[-1]
        if len(found.registered) <= len(best.registered):
            continue
        if not agree(best.registered, found.registered):
            progress.note("what was found so contradicts what was known of the others: left out")
        elif not tied(found.made, best.registered):
            progress.note("what was found so hangs on one thing that both show: left out")
        else:
            best = found
    for one in tried:
        seal_features(Path(one.job.database))
    return best


def learned_alone(job: Job) -> Job:
    """The job with learned features in the place of SIFT's."""
    everything = tuple(range(1, len(job.images) + 1))
    return replace(job, pairing=None, learned=Learned(everything, _POINTS, _PARTNERS))


def agree(known: Mapping[str, Floats], found: Mapping[str, Floats]) -> bool:
    """Whether the cameras of two models that share photos lie alike."""
    shared = sorted(known.keys() & found.keys())
    if len(shared) < _SHARED:
        return True
    before, after = (np.array([one[name] for name in shared]) for one in (known, found))
    try:
        moved = fit_similarity(after, before).apply(after) - before
    except InputError:  # cameras on a line or in one place tell nothing
        return True
    apart = np.linalg.norm(moved, axis=1)
    return bool(np.median(apart) <= _ALIKE * np.ptp(before, axis=0).max())


_WORDS = {"closer": "doubled in size", "learned": "by a network"}


def _others(settings: SparseSettings) -> Iterator[tuple[str, Callable[[Job, set[str]], Job]]]:
    if settings.features not in ("auto", "thorough"):
        return
    if settings.first_octave > -1:
        yield "closer", _closer
    if settings.features == "thorough":
        yield "learned", _learned


def _closer(job: Job, names: set[str]) -> Job:
    """SIFT on doubled photos for the names; the others as they are."""
    others = {entry.name: entry.name for entry in job.images if entry.name not in names}
    return replace(
        job,
        database=_beside(job, "closer"),
        sift=Sift(2 * job.sift.max_features, -1),
        known_features=KnownFeatures(job.database, others, matches=True),
    )


def _learned(job: Job, names: set[str]) -> Job:
    """Learned features for the names, beside all that was found."""
    everything = {entry.name: entry.name for entry in job.images}
    images = tuple(k for k, entry in enumerate(job.images, start=1) if entry.name in names)
    return replace(
        job,
        database=_beside(job, "learned"),
        pairing=None,
        known_features=KnownFeatures(job.database, everything, matches=True),
        learned=Learned(images, _POINTS, _PARTNERS),
    )


def _beside(job: Job, name: str) -> str:
    """The database of another attempt: a folder of its own beside that of the first."""
    first = Path(job.database).parent
    return str(first.with_name(f"{first.name.partition('.')[0]}.{name}") / "features.db")


def _with_neighbours(job: Job, out: set[str]) -> set[str]:
    """The names and, for each, the photos beside them that share most matches with it.

    Where a third stays out, or a photo without a match, which may belong anywhere: all.
    """
    from walltopo.geometry.colmap import pycolmap

    names = [entry.name for entry in job.images]
    away = {k for k, name in enumerate(names, start=1) if name in out}
    shared: dict[int, list[tuple[int, int]]] = {k: [] for k in away}
    with pycolmap.Database.open(job.database) as db:
        for pair, count in zip(*db.read_num_matches(), strict=True):
            for a, b in (ab := pycolmap.pair_id_to_image_pair(pair), ab[::-1]):
                if a in away and b not in away and count:
                    shared[a].append((-count, b))
    if 3 * len(away) > len(names) or not all(shared.values()):
        return set(names)
    near = {b for matched in shared.values() for _, b in sorted(matched)[:_NEIGHBOURS]}
    return out | {names[b - 1] for b in near}
