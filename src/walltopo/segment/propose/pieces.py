"""Instances of the lift and bumps of the mesh, put together as pieces of surface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.geometry.neighbours import face_neighbours
from walltopo.geometry.panels import NO_PANEL, Heights, Panel, find_panels, heights_over
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord
from walltopo.segment.propose.bumps import find_bumps, stands_out
from walltopo.segment.propose.evidence import CUES, Masks, cues_of
from walltopo.segment.propose.surroundings import Relief, Surroundings
from walltopo.segment.propose.tint import Sight, Tint, tints

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]

FLOOR = 0.85  # upward part of the normal of floors, mats and tops
COMPANY = 1.0  # metres: so far around other holds are counted
INSIDE = 0.5  # share of an unsure instance that lies in a bump, from which on it is of the bump
# Share of a bump that such instances cover: with less than the first they are something on it,
# from the second on they are all of it.
SPECK, COVERED = 0.1, 0.4


@dataclass(frozen=True, eq=False)
class Pieces:
    """All that may be a hold.

    Parameters
    ----------
    label : (F,) int32, the piece of each measured triangle, 0 = wall.
    ids : of the pieces, ascending.
    new : ids of pieces that no mask was lifted to.
    joined : ids of instances whose triangles a bump replaced, each with those that are one with it.
    relief, masks, tint : of each piece by id.
    """

    label: Labels
    ids: tuple[int, ...]
    new: frozenset[int]
    joined: Mapping[int, tuple[int, ...]]
    relief: Mapping[int, Relief]
    masks: Mapping[int, Masks]
    tint: Mapping[int, Tint]

    def cues(self) -> Floats:
        """(n, len(CUES)) of the pieces, in the order of `ids`."""
        rows = [cues_of(self.relief[k], self.masks[k], self.tint[k]) for k in self.ids]
        return np.array(rows).reshape(-1, len(CUES))


def masks_of(records: Sequence[InstanceRecord], found: Detections) -> dict[int, Masks]:
    """What the masks say of each instance of the lift."""
    said = {}
    for record in records:
        scores = [found.masks[photo][mask].score for photo, mask in record.views]
        said[record.id] = Masks(record.score, max(scores, default=0.0), len(scores))
    return said


def join(
    label: Labels, bumps: Sequence[NDArray[np.int64]], areas: Floats, unsure: frozenset[int]
) -> tuple[Labels, set[int], dict[int, tuple[int, ...]]]:
    """Put bumps among the instances.

    Unsure instances that lie in a bump and cover a good part of it keep their outline, and the bump
    is theirs. Those that cover little of it become the bump, with the id of the one that covers
    most. Triangles of other instances stay theirs.

    Parameters
    ----------
    label : (F,) int32, 0 = none; areas : (F,).

    Returns
    -------
    (F,) int32; ids that are new; ids of instances that a bump replaced, each with those others
    that are one with it.
    """
    label = label.copy()
    size = np.bincount(label, areas, minlength=int(label.max(initial=0)) + 1)
    new: set[int] = set()
    joined: dict[int, tuple[int, ...]] = {}
    following = len(size)
    for rows in bumps:
        whole = float(areas[rows].sum())
        shared = np.bincount(label[rows], areas[rows], minlength=len(size))[: len(size)]
        inside = [
            number
            for number in np.flatnonzero(shared).tolist()
            if number in unsure and shared[number] >= max(INSIDE * size[number], SPECK * whole)
        ]
        if sum(shared[inside]) >= COVERED * whole:
            continue
        free = rows[np.isin(label[rows], [0, *inside])]
        if inside:
            number = max(inside, key=lambda one: (float(shared[one]), -one))
            joined[number] = tuple(one for one in inside if one != number)
            label[np.isin(label, inside)] = 0
        else:
            number, following = following, following + 1
            new.add(number)
        label[free] = number
    return label, new, joined


def _together(said: Mapping[int, Masks], number: int, others: Sequence[int]) -> Masks:
    """What the masks of instances say that are one."""
    rows = [said[one] for one in (number, *others) if one in said]
    return Masks(
        max((row.support for row in rows), default=0.0),
        max((row.best for row in rows), default=0.0),
        sum(row.count for row in rows),
    )


@dataclass(frozen=True, eq=False)
class Ground:
    """What is known of a mesh before anyone asks what is a hold.

    Parameters
    ----------
    mesh : the scan's, without guesses; unit : mesh units a metre.
    neighbours : (F, 3), see `face_neighbours`; panels, heights : the wall's.
    """

    mesh: Mesh
    unit: float
    neighbours: NDArray[np.int32]
    panels: list[Panel]
    heights: Heights

    @classmethod
    def of(cls, mesh: Mesh, unit: float, level: bool, seed: int) -> Ground:
        """Find the panels; `level`: z is up, so that floors can be told from walls."""
        upward = mesh.normals[:, 2] > FLOOR if level else np.zeros(len(mesh.faces), dtype=np.bool_)
        panels = find_panels(mesh, np.flatnonzero(~upward), unit, seed=seed)
        heights = heights_over(mesh, panels, unit)
        return cls(mesh, unit, face_neighbours(mesh.faces), panels, heights)


def gather_pieces(
    ground: Ground,
    label: Labels,
    said: Mapping[int, Masks],
    sure: float,
    seen: Iterable[Sight],
) -> Pieces:
    """All pieces of a scan and what is known of them.

    Parameters
    ----------
    label : (F,) int32, instances of the lift; said : of each, as of `masks_of`.
    sure : the score from which on the lift's outline is kept; seen : the photos.
    """
    mesh, heights, panels = ground.mesh, ground.heights, ground.panels
    sure_ids = [number for number, masks in said.items() if masks.support >= sure]
    sure_label = np.where(np.isin(label, sure_ids), label, 0).astype(np.int32)
    bumps = find_bumps(mesh, ground.neighbours, heights, panels, sure_label, ground.unit)
    unsure = frozenset(said) - frozenset(sure_ids)
    label, new, joined = join(label, bumps, mesh.areas, unsure)
    relief = _reliefs(ground, label, sure_ids)
    out, _ = stands_out(heights, panels, ground.unit)
    wall = (label == 0) & (heights.panel != NO_PANEL) & ~out
    tint = tints(seen, label, wall)
    return Pieces(
        label,
        tuple(relief),
        frozenset(new),
        joined,
        relief,
        {number: _together(said, number, joined.get(number, ())) for number in relief},
        {number: tint.get(number, Tint()) for number in relief},
    )


def _reliefs(ground: Ground, label: Labels, sure: Sequence[int]) -> dict[int, Relief]:
    """The relief of each piece, by ascending id; `sure` are the ids that masks are sure of."""
    around = Surroundings(ground.mesh, ground.heights, ground.panels, label, ground.unit)
    present = np.unique(label[label > 0]).tolist()
    order = np.argsort(label, kind="stable")
    ends = np.searchsorted(label[order], [[number, number + 1] for number in present])
    rows = {
        number: order[first:last]
        for number, (first, last) in zip(present, ends.tolist(), strict=True)
    }
    places = {number: ground.mesh.centroids[own].mean(axis=0) for number, own in rows.items()}
    company = np.array([places[number] for number in sure if number in places]).reshape(-1, 3)
    others = cKDTree(company)
    return {
        number: around.relief(own, _company(others, places[number], ground.unit))
        for number, own in rows.items()
    }


def _company(others: cKDTree, place: Floats, unit: float) -> int:
    """Sure instances around a place, without the one that is there."""
    near = others.query_ball_point(place, COMPANY * unit, return_length=True)
    here = others.query_ball_point(place, 1e-6 * unit, return_length=True)
    return int(near - here)
