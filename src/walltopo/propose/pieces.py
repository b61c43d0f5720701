"""Instances of the lift and bumps of the mesh, put together as pieces of surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, View
from walltopo.meshes.neighbours import face_neighbours
from walltopo.meshes.panels import NO_PANEL, Heights, Panel, find_panels, heights_over
from walltopo.propose.bumps import find_bumps, stands_out
from walltopo.propose.evidence import CUES, Masks, cues_of
from walltopo.propose.surroundings import Relief, Surroundings
from walltopo.propose.tint import Tint, tints
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord
from walltopo.scans.photo_set import PhotoSet

__all__ = ["Ground", "Pieces", "gather_pieces", "join", "masks_of"]

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]

FLOOR = 0.85  # upward part of the normal of floors, mats and tops
INSIDE = 0.5  # share of an unsure instance in a bump, from which on both are one piece


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

    An unsure instance of which a bump holds `INSIDE` or more becomes that bump, with its own id; of
    several the one that shares most. Triangles of others stay theirs.

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
        shared = np.bincount(label[rows], areas[rows], minlength=len(size))
        inside = [
            number
            for number in np.flatnonzero(shared).tolist()
            if number in unsure and number < len(size) and shared[number] >= INSIDE * size[number]
        ]
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
    views: Sequence[View],
    photos: PhotoSet,
    progress: Progress,
) -> Pieces:
    """All pieces of a scan and what is known of them.

    Parameters
    ----------
    label : (F,) int32, instances of the lift; said : of each, as of `masks_of`.
    sure : the score from which on the lift's outline is kept.
    """
    mesh, heights, panels = ground.mesh, ground.heights, ground.panels
    sure_ids = [number for number, masks in said.items() if masks.support >= sure]
    of_sure = np.isin(label, sure_ids)
    bumps = find_bumps(mesh, ground.neighbours, heights, panels, of_sure, ground.unit)
    label, new, joined = join(label, bumps, mesh.areas, frozenset(said) - frozenset(sure_ids))
    relief = _reliefs(ground, label)
    out, _ = stands_out(heights, panels, ground.unit)
    wall = (label == 0) & (heights.panel != NO_PANEL) & ~out
    tint = tints(mesh, views, photos, label, wall, progress)
    return Pieces(
        label,
        tuple(relief),
        frozenset(new),
        joined,
        relief,
        {number: _together(said, number, joined.get(number, ())) for number in relief},
        {number: tint.get(number, Tint()) for number in relief},
    )


def _reliefs(ground: Ground, label: Labels) -> dict[int, Relief]:
    """The relief of each piece, by ascending id."""
    around = Surroundings(ground.mesh, ground.heights, ground.panels, label, ground.unit)
    present = np.unique(label[label > 0]).tolist()
    order = np.argsort(label, kind="stable")
    ends = np.searchsorted(label[order], [[number, number + 1] for number in present])
    return {
        number: around.relief(order[first:last])
        for number, (first, last) in zip(present, ends.tolist(), strict=True)
    }
