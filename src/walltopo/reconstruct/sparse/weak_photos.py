"""Drop photos that a model does not hold, and refuse a model that holds nothing well.

COLMAP registers a photo by 30 matched points and never looks again: bundle adjustment may drop most
of them, and the photo stays anywhere.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError

Floats = NDArray[np.float64]

# Half of the points by which COLMAP registers a photo (`abs_pose_min_num_inliers`, 30).
_MIN_OWN_POINTS = 15
# A photo with fewer points must also agree with the other photos' up direction.
_FEW_OWN_POINTS = 60
_MAX_ROLL_DEG = 45.0  # a phone that is turned further is turned by a quarter
# Median over the photos. The demo and `gym-a` have 1,700 and 2,200, a smooth generated wall by SIFT
# alone has 81; two real walls whose cameras were wrong had about 36 and 51.
WEAK_POINTS = 60
# Points that link a photo to the others: as many as COLMAP wants to register it. On two generated
# walls, right photos had 48 and more (one had 17), groups in a wrong place 20 and fewer; of 14
# photos that XFeat placed on one of them, 6 of the 7 wrong ones go, and no right one.
_MIN_LINKS = 30


def own_points(model: Any) -> dict[str, int]:
    """Return how many points of the model each registered photo shows, by its name.

    Parameters
    ----------
    model : `pycolmap.Reconstruction`.
    """
    return {
        str(image.name): int(image.num_points3D)
        for image in model.images.values()
        if image.has_pose
    }


def drop_weak_photos(model: Any) -> dict[str, str]:
    """Unregister the photos that the model does not hold; return the reason of each by its name.

    Each lacks points of its own for its pose, or has few and is turned against all others.

    Parameters
    ----------
    model : `pycolmap.Reconstruction`, changed in place; each photo is a frame of its own.
    """
    reasons: dict[str, str] = {}
    while True:  # without a photo, its points may lack a second view: others get weaker
        found = _find_weak(model)
        if not found:
            return reasons
        reasons.update(found)
        for number in [k for k, image in model.images.items() if str(image.name) in found]:
            model.deregister_frame(model.images[number].frame_id)


def drop_barely_linked(model: Any) -> dict[str, str]:
    """Unregister the photos that too few points link to the others; return reasons by name.

    A group grows by the photo that shares most points with it, while those are enough; the largest
    group stays. Groups that a few points join bend there, however many points each has.

    Parameters
    ----------
    model : `pycolmap.Reconstruction`, changed in place; each photo is a frame of its own.
    """
    registered = sorted(k for k, image in model.images.items() if image.has_pose)
    shown: dict[int, set[int]] = {k: set() for k in registered}
    for number, point in model.points3D.items():
        for element in point.track.elements:
            shown[element.image_id].add(number)
    groups: list[set[int]] = []
    rest = dict(shown)
    while rest:
        groups.append(_linked_group(rest))
        rest = {k: points for k, points in rest.items() if k not in groups[-1]}
    kept = max(groups, key=len, default=set())
    seen = set().union(*(shown[k] for k in kept))
    reasons = {}
    for k in sorted(shown.keys() - kept):
        reasons[str(model.images[k].name)] = (
            f"only {len(shown[k] & seen)} points link it to the others: take photos between them"
        )
        model.deregister_frame(model.images[k].frame_id)
    return reasons


def _linked_group(shown: Mapping[int, set[int]]) -> set[int]:
    """Return the photos of one group.

    Parameters
    ----------
    shown : the points that each photo shows; photos ascending.
    """
    showing: defaultdict[int, list[int]] = defaultdict(list)
    for photo, points in shown.items():
        for point in points:
            showing[point].append(photo)
    pairs = Counter(pair for photos in showing.values() for pair in combinations(photos, 2))
    first = min(pairs, key=lambda pair: (-pairs[pair], pair), default=None)
    if first is None or pairs[first] < _MIN_LINKS:
        return set(list(shown)[:1])
    group: set[int] = set()
    seen: set[int] = set()
    links = dict.fromkeys(shown, 0)  # points that a photo shares with the group
    joining = list(first)
    while joining:
        photo = joining.pop()
        group.add(photo)
        for point in shown[photo] - seen:
            for other in showing[point]:
                links[other] += 1
        seen |= shown[photo]
        if not joining:
            linked = [k for k in shown if k not in group and links[k] >= _MIN_LINKS]
            joining = [max(linked, key=lambda k: links[k])] if linked else []
    return group


def _find_weak(model: Any) -> dict[str, str]:
    points = own_points(model)
    rolls = roll_angles(model)
    found = {}
    for name, count in points.items():
        if count < _MIN_OWN_POINTS:
            found[name] = f"only {count} of its points are in the model: take photos beside it"
        elif count < _FEW_OWN_POINTS and rolls[name] > _MAX_ROLL_DEG:
            found[name] = (
                f"only {count} of its points are in the model, which would turn it by "
                f"{rolls[name]:.0f} degrees: take photos beside it"
            )
    return found


def roll_angles(model: Any) -> dict[str, float]:
    """Return by how many degrees each photo is turned about its viewing direction, in [0, 180].

    It is relative to the up direction on which most photos agree: the median of their own.

    Parameters
    ----------
    model : `pycolmap.Reconstruction`.
    """
    images = [image for image in model.images.values() if image.has_pose]
    if not images:
        return {}
    rotations = np.array([image.cam_from_world().rotation.matrix() for image in images])
    # The rows are the camera's axes in the world: x to the right, y down.
    rights, ups = rotations[:, 0], -rotations[:, 1]
    up = np.median(ups, axis=0)
    length = np.linalg.norm(up)
    if length < 1e-6:  # no direction is common to most
        return {str(image.name): 0.0 for image in images}
    along_right, along_up = rights @ (up / length), ups @ (up / length)
    degrees = np.degrees(np.abs(np.arctan2(along_right, along_up)))
    return {str(image.name): float(one) for image, one in zip(images, degrees, strict=True)}


def check_strength(model: Any, *, accept_weak: bool) -> int:
    """Return the median number of own points of the photos.

    Raises
    ------
    StageError : it is below `WEAK_POINTS`, and `accept_weak` is false.
    """
    counts = own_points(model)
    median = int(np.median(list(counts.values())))
    if median < WEAK_POINTS and not accept_weak:
        raise StageError(
            f"the {len(counts)} photos that fit together share too few points for a mesh: "
            f"{model.num_points3D()} in all, {median} in the median photo, "
            f"{WEAK_POINTS} are needed",
            "Take more photos of the same wall that overlap by two thirds, closer and sharp, with "
            "something to recognise in each: holds, tape, stickers. sparse.accept_weak=true goes "
            "on with these.",
        )
    return median
