"""Match the masks of photos with the cameras of a model, by name."""

from __future__ import annotations

import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from walltopo.core import InputError, Mask, View

_PICTURES = {".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".bmp", ".heic", ".avif"}
_SHOWN = 5  # names listed in a message


@dataclass(frozen=True)
class MatchedViews:
    """The views with their masks.

    Parameters
    ----------
    views : all views, in their order; those without masks of their photo have none.
    without_camera : names of the photos that have masks but no camera.
    photos : number of photos that the masks are of.
    """

    views: list[View]
    without_camera: tuple[str, ...]
    photos: int

    def describe_loss(self) -> str:
        """Return how many photos of the masks have no camera, and which; empty for none."""
        lost = self.without_camera
        if not lost:
            return ""
        return (
            f"{len(lost)} of {self.photos} photos of the masks have no camera: {_list_names(lost)}"
        )


def attach_masks(
    views: Sequence[View], masks: Mapping[str, Sequence[Mask]], *, allow_missing: bool = False
) -> MatchedViews:
    """Return the views with their masks, matched by name.

    A mask's photo belongs to the camera that shares most of its path, counted from the end. The
    last parts must be equal, or equal without their suffixes (`0001.png` and COLMAP's
    `0001.jpg.png` belong to `0001.jpg`). Names are compared in Unicode's form NFC.

    Parameters
    ----------
    masks : photo name to its masks.
    allow_missing : whether more than half of the photos of the masks may lack a camera.

    Raises
    ------
    InputError : two cameras or two photos of masks match equally well; no photo of the masks has a
        camera; or more than half have none and `allow_missing` is False.
    """
    camera_of = _cameras_of([view.name for view in views], list(masks))
    photo_of = {camera: photo for photo, camera in camera_of.items()}
    result = [
        view.with_masks(tuple(masks[photo_of[view.name]] if view.name in photo_of else ()))
        for view in views
    ]
    lost = tuple(name for name in masks if name not in camera_of)
    matched = MatchedViews(result, lost, len(masks))
    if masks and len(lost) == len(masks):
        raise InputError(
            f"masks and cameras have no photo in common: masks of {_list_names(list(masks))}, "
            f"cameras of {_list_names([view.name for view in views])}",
            "Masks and cameras are matched by file name.",
        )
    if 2 * len(lost) > len(masks) and not allow_missing:
        raise InputError(
            matched.describe_loss(),
            "Masks and cameras are matched by file name. If the other photos have no camera on "
            "purpose, allow it by --allow-missing.",
        )
    return matched


def _cameras_of(cameras: Sequence[str], photos: Sequence[str]) -> dict[str, str]:
    """Return the camera of each photo that has one."""
    by_stem: dict[str, list[str]] = defaultdict(list)
    for camera in cameras:
        by_stem[_name_stem(_name_parts(camera)[-1])].append(camera)
    claims: dict[str, list[tuple[tuple[int, int], str]]] = defaultdict(list)
    for photo in photos:
        scored = [
            (_match_score(photo, camera), camera)
            for camera in by_stem[_name_stem(_name_parts(photo)[-1])]
        ]
        if not scored:
            continue
        best = max(score for score, _ in scored)
        found = [camera for score, camera in scored if score == best]
        if len(found) > 1:
            raise _ambiguous_error(f"the masks of {photo!r}", "cameras", found)
        claims[found[0]].append((best, photo))
    result: dict[str, str] = {}
    for camera, claimed in claims.items():
        best = max(score for score, _ in claimed)
        names = [photo for score, photo in claimed if score == best]
        if len(names) > 1:
            raise _ambiguous_error(f"the camera of {camera!r}", "photos of the masks", names)
        result[names[0]] = camera
    return result


def _ambiguous_error(what: str, kind: str, names: Sequence[str]) -> InputError:
    return InputError(
        f"{what} may belong to {len(names)} {kind}: {_list_names(names)}",
        "Give masks and cameras the same folders, for example cam0/0001.jpg in both.",
    )


def _name_parts(name: str) -> tuple[str, ...]:
    """Return the parts of a name, in NFC, with either kind of slash."""
    return PurePosixPath(unicodedata.normalize("NFC", name).replace("\\", "/")).parts or ("",)


def _name_stem(last: str) -> str:
    """Return the last part of a name without its suffixes of pictures."""
    path = PurePosixPath(last)
    inner = PurePosixPath(path.stem)
    return inner.stem if inner.suffix.lower() in _PICTURES else path.stem


def _match_score(photo: str, camera: str) -> tuple[int, int]:
    """Return the number of equal parts from the end, and how equal the last parts are."""
    a, b = _name_parts(photo), _name_parts(camera)
    equal = 1
    for left, right in zip(reversed(a[:-1]), reversed(b[:-1]), strict=False):
        if left != right:
            break
        equal += 1
    # COLMAP names the mask of 0001.jpg 0001.jpg.png.
    exact = 2 if a[-1] == b[-1] else int(PurePosixPath(a[-1]).stem == b[-1])
    return equal, exact


def _list_names(names: Iterable[str]) -> str:
    every = list(names)
    more = f" and {len(every) - _SHOWN} more" if len(every) > _SHOWN else ""
    return ", ".join(every[:_SHOWN]) + more
