"""Start tags: what looks like a card at the same place of the wall in enough photos."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.holds.observations import Picture
from walltopo.holds.tag_fit import CORNERS, PRINT
from walltopo.holds.tag_looks import CardLook, CardSizes, card_looks
from walltopo.scans.attributes import StartTag

__all__ = ["BandLook", "FoundTag", "TagFinder", "band_looks", "likelihood", "record_of"]

Floats = NDArray[np.float64]

# Logistic regression on all of `tag_fit.EVIDENCE` but the corners, by
# `python -m walltopo_lab.benchmarks.routes_tags fit` (docs/routes.md).
WEIGHTS = np.array(
    [
        -1.93,  # worst side
        6.63,  # third side
        1.86,  # second side
        -1.43,  # best side
        0.33,  # contrast
        10.13,  # paper
        12.68,  # print
        -27.53,  # spill
        -30.29,  # chroma
    ]
)
BIAS = -12.83
# What a card must have, whatever the rest: generated walls have nothing round and white on them.
LEAST_PRINT, LEAST_CORNERS = 0.04, 0.4
LIKELY = 0.2  # looks that are less likely a card's are forgotten
SAME = 0.3  # longest sides: looks this near to each other are of one card
LEAST_PHOTOS = 2  # one photo alone may mistake anything
CLEAR_PX = 15  # pixels of a card's longer side from which a photo must show it
HIDDEN = 2.0  # times `CardSizes.flat`: what is seen this much nearer hides a card
CLEAR_FACING = 0.4  # cosine of the angle at which such a photo sees the wall, at least


@dataclass(frozen=True, eq=False)
class FoundTag:
    """A start tag.

    Parameters
    ----------
    position : (3,) middle; normal : (3,) unit, out of the wall; world frame.
    width, height : of its longer and of its shorter side, scan units.
    confidence : share of the photos that show its place clearly in which it was found, times
        how much it looks like a card there.
    looks : what those photos show, best first.
    instance : the instance that it was taken for, 0 = none.
    """

    position: Floats
    normal: Floats
    width: float
    height: float
    confidence: float
    looks: tuple[CardLook, ...]
    instance: int


@dataclass(frozen=True, eq=False)
class BandLook:
    """The band of a tag in one photo (a `colour.Look`).

    Parameters
    ----------
    photo : its number; linear : (3,) linear RGB as the photo has it; quality : its weight.
    """

    photo: int
    linear: Floats
    quality: float


def band_looks(tag: FoundTag) -> list[BandLook]:
    """Where photos show a coloured band on a tag; none unless half of them do."""
    looks = [
        BandLook(look.photo, look.linear, float(look.pixels))
        for look in tag.looks
        if look.linear is not None
    ]
    return looks if 2 * len(looks) >= len(tag.looks) else []


def record_of(number: int, tag: FoundTag, colour: str, photos: Sequence[str]) -> StartTag:
    """The entry of `attributes.json`; `photos`: names of the photos, by number."""
    x, y, z = (float(v) for v in tag.position)
    nx, ny, nz = (float(v) for v in tag.normal)
    return StartTag(
        id=number,
        position=(x, y, z),
        normal=(nx, ny, nz),
        width_m=tag.width,
        height_m=tag.height,
        colour=colour,
        confidence=tag.confidence,
        photos=tuple(photos[look.photo] for look in tag.looks),
    )


def likelihood(look: CardLook) -> float:
    """Probability, by its looks alone, that this is a card; 0 without print or corners."""
    printed = look.evidence[PRINT] >= LEAST_PRINT or look.linear is not None
    if not printed or look.evidence[CORNERS] < LEAST_CORNERS:
        return 0.0
    return float(1 / (1 + np.exp(-(look.evidence[: len(WEIGHTS)] @ WEIGHTS + BIAS))))


class TagFinder:
    """Collects looks photo by photo, then says where tags are.

    Parameters
    ----------
    mesh : the scan's mesh, and the one that pictures show; sizes : of cards.
    small : instances that may be cards taken for holds; on others there are no tags.
    """

    def __init__(self, mesh: Mesh, sizes: CardSizes, small: Collection[int] = ()) -> None:
        self.mesh, self.sizes, self.small = mesh, sizes, small
        self.likely: list[tuple[float, CardLook]] = []
        self.views: dict[int, View] = {}

    def read(self, picture: Picture) -> None:
        """Note what looks like a card in a photo."""
        self.views[picture.number] = picture.view
        for look in card_looks(picture, self.mesh, self.sizes):
            if look.instance and look.instance not in self.small:
                continue
            sure = likelihood(look)
            if sure >= LIKELY and look.relief <= self.sizes.flat:
                self.likely.append((sure, look))

    def tags(self, least_confidence: float) -> list[FoundTag]:
        """The tags, from left to right as the looks come; the surest of any that overlap."""
        places = [looks for looks in self._places() if len(looks) >= LEAST_PHOTOS]
        if not places:
            return []
        middles = np.array([np.median([look.position for _, look in p], axis=0) for p in places])
        normals = np.array([p[0][1].normal for p in places])
        widths = np.array([np.median([look.width for _, look in p]) for p in places])
        clear = self.clear_photos(middles, normals, widths)
        found = []
        for k, looks in enumerate(places):
            photos = {look.photo for _, look in looks} | clear[k]
            confidence = sum(sure for sure, _ in looks) / len(photos)
            if confidence >= least_confidence:
                found.append(self._tag(looks, confidence))
        return found

    def _places(self) -> list[list[tuple[float, CardLook]]]:
        """Looks by the card they are of: the surest first, each photo once."""
        reach = SAME * self.sizes.longest
        places: list[list[tuple[float, CardLook]]] = []
        for sure, look in sorted(self.likely, key=lambda item: (-item[0], item[1].photo)):
            for place in places:
                if np.linalg.norm(place[0][1].position - look.position) < reach:
                    if all(other.photo != look.photo for _, other in place):
                        place.append((sure, look))
                    break
            else:
                places.append([(sure, look)])
        return places

    def clear_photos(self, places: Floats, normals: Floats, widths: Floats) -> list[set[int]]:
        """For each place the photos that show it large, not too slantwise, and unhidden."""
        from walltopo.raycast.bvh import Bvh

        bvh = Bvh(self.mesh.vertices, self.mesh.faces)
        found: list[set[int]] = [set() for _ in places]
        for number, view in self.views.items():
            way = places - view.centre
            away = np.linalg.norm(way, axis=1)
            facing = -(way * normals).sum(axis=1) / away
            pixels = view.project(places)
            with np.errstate(invalid="ignore"):
                margin = view.camera.fx * widths / away
                size = np.array([view.camera.width, view.camera.height])
                inside = ((pixels > margin[:, None]) & (pixels < size - margin[:, None])).all(
                    axis=1
                )
            shown = inside & (facing > CLEAR_FACING) & (margin * np.sqrt(facing.clip(0)) > CLEAR_PX)
            rows = np.flatnonzero(shown)
            if len(rows) == 0:
                continue
            origins = np.tile(view.centre, (len(rows), 1))
            _, hit = bvh.first_hit(origins, way[rows])
            # `hit` counts in lengths of `way`.
            near = np.abs(hit - 1) * away[rows] < HIDDEN * self.sizes.flat
            for row in rows[near].tolist():
                found[row].add(number)
        return found

    def _tag(self, looks: Sequence[tuple[float, CardLook]], confidence: float) -> FoundTag:
        own = [look for _, look in looks]
        on = [look.instance for look in own]
        return FoundTag(
            np.median([look.position for look in own], axis=0),
            own[0].normal,
            float(np.median([look.width for look in own])),
            float(np.median([look.height for look in own])),
            min(1.0, confidence),
            tuple(own),
            max(set(on), key=lambda number: (on.count(number), -number)),
        )
