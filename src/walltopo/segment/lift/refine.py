"""Refine the mesh along the borders of instances, so that objects on a coarse mesh are sharp.

Triangles around each border are cut at the midpoints of their edges, and the masks label the
pieces. The surface does not move; only its division changes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances, Mesh, Progress, Silent, View
from walltopo.segment.lift.distance import resolve_lengths
from walltopo.segment.lift.robust import robust_evidence
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.lift.vote import vote

Bools = NDArray[np.bool_]
Ints = NDArray[np.int32]
Rows = NDArray[np.int64]

MAX_LEVELS = 8


def refine_borders(
    mesh: Mesh,
    views: Sequence[View],
    instances: Instances,
    params: LiftParams | None = None,
    levels: int = 2,
    progress: Progress | None = None,
) -> tuple[Mesh, Instances]:
    """Cut the triangles at the borders of instances, and label the pieces by the masks.

    Parameters
    ----------
    mesh, views, params : the inputs of the lift that returned `instances`.
    levels : number of passes; each halves the edges along borders.

    Returns
    -------
    The finer mesh and its labels. Ids and records are those of `instances`.

    Notes
    -----
    The robust vote labels the pieces, with the masks of each instance, whatever `params.method`
    is. Triangles away from borders keep their label. If an instance would lose all its pieces, it
    keeps them as they were.

    Raises
    ------
    InputError : `levels` is out of range, or `instances` belongs to another mesh.
    """
    if not 0 <= levels <= MAX_LEVELS:
        raise InputError(f"refine borders: levels must be 0..{MAX_LEVELS}, got {levels}")
    if len(instances.face_instance) != len(mesh.faces):
        raise InputError(
            f"refine borders: the mesh has {len(mesh.faces)} triangles, the instances label "
            f"{len(instances.face_instance)}",
            "Pass the mesh that the instances were lifted onto.",
        )
    if levels == 0 or not instances.records:
        return mesh, instances
    progress = progress or Silent()
    params = resolve_lengths(params or LiftParams(), mesh, views)
    cluster = _cluster_of(views, instances)
    for level in range(levels):
        progress.step(f"refine borders, level {level + 1}")
        crossed = _at_borders(mesh, instances.face_instance)
        mesh, parent = split_faces(mesh, crossed)
        inherited = Instances(
            instances.face_instance[parent], instances.face_score[parent], instances.records
        )
        instances = _relabel_pieces(
            mesh, views, inherited, cluster, crossed[parent], params, progress
        )
    return mesh, instances


def _cluster_of(views: Sequence[View], instances: Instances) -> Ints:
    """Return (P,) instance id - 1 of the masks that support an instance, -1 for the others."""
    first = np.cumsum([0, *(len(view.masks) for view in views)])
    cluster = np.full(int(first[-1]), -1, dtype=np.int32)
    for record in instances.records:
        for view, mask in record.views:
            cluster[first[view] + mask] = record.id - 1
    return cluster


def _at_borders(mesh: Mesh, label: Ints) -> Bools:
    """Return (F,) whether a face has a vertex at which faces with several labels meet.

    A true border may run through the triangles on both sides of the labelled one, and through
    those that touch it with a corner only.
    """
    low = np.full(len(mesh.vertices), np.iinfo(np.int32).max, dtype=np.int32)
    high = np.full(len(mesh.vertices), -1, dtype=np.int32)
    for k in range(3):
        np.minimum.at(low, mesh.faces[:, k], label)
        np.maximum.at(high, mesh.faces[:, k], label)
    mixed: Bools = low < high
    a, b, c = mesh.faces.T
    return mixed[a] | mixed[b] | mixed[c]


def _relabel_pieces(
    mesh: Mesh,
    views: Sequence[View],
    inherited: Instances,
    cluster: Ints,
    pieces: Bools,
    params: LiftParams,
    progress: Progress,
) -> Instances:
    """Return the instances after the views voted on the pieces of cut triangles."""
    evidence = robust_evidence(mesh, views, params, progress)
    winner, shares = vote(evidence, cluster, params)
    found = np.zeros(len(mesh.faces), dtype=np.int32)
    score = np.zeros(len(mesh.faces), dtype=np.float32)
    found[evidence.faces] = winner + 1
    score[evidence.faces] = np.where(winner >= 0, shares, 0.0)
    before = inherited.face_instance
    label = np.where(pieces, found, before)
    emptied = np.setdiff1d(before[before > 0], label)
    keeps = ~pieces | np.isin(before, emptied)
    return Instances(
        np.where(keeps, before, found).astype(np.int32),
        np.where(keeps, inherited.face_score, score).astype(np.float32),
        inherited.records,
    )


def split_faces(mesh: Mesh, chosen: Bools) -> tuple[Mesh, Rows]:
    """Cut faces into four at the midpoints of their edges, and cut neighbours to fit.

    A face that shares one or two edges with chosen ones is cut into two or three, so that no
    vertex lies on another face's edge. Orientation and area are preserved. A midpoint gets the
    mean colour of the edge's ends. Vertices of `mesh` keep their numbers.

    Parameters
    ----------
    chosen : (F,) bool.

    Returns
    -------
    The mesh, and (F',) int64: the face of `mesh` from which each face was cut, ascending.
    """
    ends = np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=-1).astype(np.int64)
    ends.sort(axis=2)
    keys = ends[..., 0] * len(mesh.vertices) + ends[..., 1]
    edges = np.unique(keys[chosen])
    cut = np.isin(keys, edges)
    middle = np.where(cut, len(mesh.vertices) + np.searchsorted(edges, keys), -1)
    a, b = edges // max(len(mesh.vertices), 1), edges % max(len(mesh.vertices), 1)
    vertices = np.concatenate([mesh.vertices, (mesh.vertices[a] + mesh.vertices[b]) / 2])
    colours = mesh.vertex_colours
    if colours is not None:
        mean = (colours[a].astype(np.uint16) + colours[b] + 1) // 2
        colours = np.concatenate([colours, mean.astype(np.uint8)])
    pieces, parents = _cut_pieces(mesh.faces.astype(np.int64), middle, vertices)
    order = np.argsort(parents, kind="stable")
    return Mesh(vertices, pieces[order].astype(np.int32), colours), parents[order]


def _cut_pieces(faces: Rows, middle: Rows, vertices: NDArray[np.float64]) -> tuple[Rows, Rows]:
    """Return the pieces of all faces, and the face from which each piece was cut.

    Parameters
    ----------
    faces : (F, 3); middle : (F, 3), the midpoint vertex of the edge from corner k to corner
        k + 1, -1 = the edge is not cut.
    """
    cuts = (middle >= 0).sum(axis=1)
    # Rotate each face so that its only cut edge is the first, or its only whole edge the last.
    turn = np.where(cuts == 1, (middle >= 0).argmax(axis=1), 0)
    turn = np.where(cuts == 2, ((middle < 0).argmax(axis=1) + 1) % 3, turn)
    columns = (turn[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, columns, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, columns, axis=1).T

    # Two cuts take off a corner; the remaining quadrilateral is cut along the shorter diagonal.
    one_way = np.linalg.norm(vertices[a] - vertices[bc], axis=1)
    other_way = np.linalg.norm(vertices[ab] - vertices[c], axis=1)
    shorter = one_way <= other_way
    plans = [
        (cuts == 0, [(a, b, c)]),
        (cuts == 1, [(a, ab, c), (ab, b, c)]),
        ((cuts == 2) & shorter, [(ab, b, bc), (a, ab, bc), (a, bc, c)]),
        ((cuts == 2) & ~shorter, [(ab, b, bc), (a, ab, c), (ab, bc, c)]),
        (cuts == 3, [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]),
    ]
    found, parents = [], []
    for which, triangles in plans:
        rows = np.flatnonzero(which)
        for corners in triangles:
            found.append(np.stack([corner[rows] for corner in corners], axis=1))
            parents.append(rows)
    return np.concatenate(found), np.concatenate(parents)
