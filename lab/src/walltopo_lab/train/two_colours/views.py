"""Views of generated holds, with the true parts of their two colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Silent, View
from walltopo.describe.classify.colour import with_white
from walltopo.describe.classify.light import ERODE, LONG_SIDE, observe
from walltopo.describe.classify.observations import HoldView, read_hold_views
from walltopo.describe.classify.two_colours import frame_view, large_views, square_of
from walltopo.describe.settings import ClassifySettings
from walltopo.geometry.zbuffer import render_culled
from walltopo.scans.colmap_model import read_views
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import SceneLight
from walltopo_lab.evaluate.truth import Truth, read_truth

# Share of a view's pixels up to which the smaller part is not visible, and from which it is.
NONE, SOME = 0.03, 0.08


@dataclass(frozen=True, eq=False)
class PartedViews:
    """Pictures of holds and the truth about them.

    Parameters
    ----------
    hold : (n,) int64 number of each view's hold.
    pictures : (n, CHANNELS, SIDE, SIDE) float32, see `frame_view`.
    parts : (n, SIDE, SIDE) float32 share of each pixel in the second colour.
    share : (n,) share of the second colour in the view.
    visible : (holds,) share of the second colour in the pixels of a hold in all its photos.
    """

    hold: NDArray[np.int64]
    pictures: NDArray[np.float32]
    parts: NDArray[np.float32]
    share: NDArray[np.float64]
    visible: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GymViews:
    """The views of a generated gym's holds, by id.

    Parameters
    ----------
    views : photographed; parts : the same views with the second colour white, all else black.
    light : of the photos.
    """

    truth: Truth
    views: dict[int, list[HoldView]]
    parts: dict[int, list[HoldView]]
    light: SceneLight

    def visible_share(self, hold: int) -> float:
        """Return the share of the second colour in the pixels of a hold in all its photos."""
        return _second_share(self.parts[hold])


def _second_share(parts: Sequence[HoldView]) -> float:
    """Return the share of white pixels in views of `GymViews.parts`; 0 without any pixel."""
    pixels = sum(view.mask.sum() for view in parts)
    second = sum((view.crop[view.mask, 0] > 127).sum() for view in parts)
    return float(second / pixels) if pixels else 0.0


def read_gym_views(gym: Path) -> GymViews:
    """Return the views of the holds of a gym of `walltopo synth`."""
    truth, views = read_truth(gym), read_views(gym / "truth" / "cameras")
    with np.load(gym / "truth" / "gt.npz") as arrays:
        second = arrays["face_second"]
    labels = truth.face_instance
    settings = ClassifySettings()
    seen, light = observe(views, PhotoSet(gym / "photos"), truth.mesh, labels, settings, Silent())

    def parts_of(view: View, width: int, height: int) -> NDArray[np.uint8]:
        camera = view.camera.scaled(width / view.camera.width)
        face, _ = render_culled(truth.mesh, camera, view.cam_from_world)
        white = (face >= 0) & second[np.maximum(face, 0)]
        return np.repeat(white[..., None].astype(np.uint8) * 255, 3, axis=2)

    parts: dict[int, list[HoldView]] = {}
    stream = read_hold_views(
        views,
        parts_of,
        truth.mesh,
        labels,
        np.full(len(labels), -1, dtype=np.int32),
        long_side=LONG_SIDE,
        erode=ERODE,
        crop_px=settings.cutout_px,
    )
    for holds, _ in stream:
        for view in holds:
            parts.setdefault(view.hold, []).append(view)
    is_hold = {number for number, one in truth.instances.items() if one.kind != "volume"}
    seen = {number: rows for number, rows in seen.items() if number in is_hold}
    return GymViews(truth, seen, parts, with_white(light, seen))


def parted_views(gym: GymViews) -> PartedViews:
    """Return the pictures of a gym's holds, numbered from 0."""
    hold, pictures, parts, share = [], [], [], []
    visible = [gym.visible_share(name) for name in sorted(gym.views)]
    for number, name in enumerate(sorted(gym.views)):
        truth = {view.photo: view for view in gym.parts[name]}
        for view in large_views(gym.views[name]):
            own = truth[view.photo]
            hold.append(number)
            pictures.append(frame_view(view, gym.light))
            parts.append(square_of(own.crop[..., :1] / 255.0, own.mask)[0])
            share.append(_second_share([own]))
    return PartedViews(
        np.array(hold), np.stack(pictures), np.stack(parts), np.array(share), np.array(visible)
    )


def joined(several: Sequence[PartedViews]) -> PartedViews:
    """Return the views of several gyms as of one."""
    starts = np.cumsum([0, *(len(one.visible) for one in several)])
    return PartedViews(
        np.concatenate([one.hold + start for one, start in zip(several, starts, strict=False)]),
        np.concatenate([one.pictures for one in several]),
        np.concatenate([one.parts for one in several]),
        np.concatenate([one.share for one in several]),
        np.concatenate([one.visible for one in several]),
    )
