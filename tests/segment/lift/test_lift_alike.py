"""Comparing groups of faces says what comparing all faces says."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from walltopo.core import Mesh, Silent, View
from walltopo.segment.lift import LiftParams
from walltopo.segment.lift.evidence import Evidence
from walltopo.segment.lift.robust import robust_evidence
from walltopo.segment.lift.similarity import compare_projections, group_faces, overlaps_of, rows_of

Bumps = tuple[Mesh, list[View], np.ndarray]


@pytest.fixture(scope="module")
def evidence(three_bumps: Bumps) -> Evidence:
    mesh, views, _ = three_bumps
    return robust_evidence(mesh, views, LiftParams(), Silent())


def entries(evidence: Evidence, face: int) -> list[tuple[int, int, float]]:
    rows = slice(evidence.starts[face], evidence.starts[face + 1])
    columns = evidence.projection[rows], evidence.view[rows], evidence.share[rows]
    return list(zip(*(column.tolist() for column in columns), strict=True))


def test_kinds_are_faces_with_equal_entries(evidence: Evidence) -> None:
    groups = group_faces(evidence)
    areas: dict[tuple[tuple[int, int, float], ...], float] = defaultdict(float)
    for face in range(len(evidence.faces)):
        areas[tuple(entries(evidence, face))] += evidence.areas[face]
    assert len(groups.faces) == len(areas) < len(evidence.faces)
    output = {
        tuple(entries(evidence, k)): a for k, a in zip(groups.faces, groups.areas, strict=True)
    }
    assert output == pytest.approx(dict(areas))


def test_rows_point_at_the_entries_of_each_projection(evidence: Evidence) -> None:
    rows = rows_of(evidence)
    for p in range(len(evidence.label)):
        own = slice(rows.starts[p], rows.starts[p + 1])
        assert (evidence.projection[rows.entry[own]] == p).all()
        assert (np.diff(rows.number[own]) > 0).all()
    assert len(rows.entry) == np.count_nonzero(evidence.projection >= 0)


def test_pairs_share_and_see_what_a_plain_loop_finds(evidence: Evidence) -> None:
    shared: dict[tuple[int, int], float] = defaultdict(float)
    seen: dict[tuple[int, int], float] = defaultdict(float)
    whole: dict[tuple[int, int], float] = defaultdict(float)
    for face, area in enumerate(evidence.areas.tolist()):
        found = entries(evidence, face)
        for p, view, mine in (entry for entry in found if entry[0] >= 0):
            for q, other, theirs in found:
                seen[p, other] += area * mine * theirs
                if q >= 0 and other != view:
                    shared[p, q] += area * min(mine, theirs)
                if q > p:
                    whole[p, q] += area
    pairs = compare_projections(evidence)
    output = list(zip(pairs.p.tolist(), pairs.q.tolist(), strict=True))
    assert output == sorted(shared)
    assert pairs.shared == pytest.approx([shared[pair] for pair in output])
    view_of = evidence.view_of
    p_seen = [max(seen[p, view_of[q]], shared[p, q]) for p, q in output]
    assert pairs.p_seen == pytest.approx(p_seen)
    mirrored = dict(zip(output, p_seen, strict=True))
    assert pairs.q_seen == pytest.approx([mirrored[q, p] for p, q in output])
    overlaps = overlaps_of(evidence)
    both = zip(overlaps.first.tolist(), overlaps.second.tolist(), strict=True)
    assert dict(zip(both, overlaps.shared.tolist(), strict=True)) == pytest.approx(whole)
