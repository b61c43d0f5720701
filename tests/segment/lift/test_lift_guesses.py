"""Guessed triangles: no evidence, no change to what is measured, and a hold's own holes are its."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.geometry.topology import face_neighbours
from walltopo.segment.lift import lift
from walltopo.segment.lift.methods import with_guesses

Bumps = tuple[Mesh, list[View], NDArray[np.int32]]


def test_measured_triangles_get_what_they_get_without_the_guesses(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    plain = lift(mesh, views)
    # A sheet before everything, which would hide the bumps from every view.
    count = len(mesh.vertices)
    nearer = 0.5 * (mesh.vertices + np.mean([view.centre for view in views], axis=0))
    whole = Mesh(
        np.concatenate([mesh.vertices, nearer]),
        np.concatenate([mesh.faces, mesh.faces + count]).astype(np.int32),
        None,
        np.arange(2 * len(mesh.faces)) >= len(mesh.faces),
    )
    found = lift(whole, views)
    assert found.records == plain.records
    assert np.array_equal(found.face_instance[: len(mesh.faces)], plain.face_instance)
    assert np.array_equal(found.face_score[: len(mesh.faces)], plain.face_score)
    assert not found.face_instance[len(mesh.faces) :].any()


def test_a_guess_within_one_instance_is_of_it_and_one_at_its_border_is_of_none(
    three_bumps: Bumps,
) -> None:
    mesh, views, _ = three_bumps
    plain = lift(mesh, views)
    label = plain.face_instance
    across = face_neighbours(mesh.faces)
    whole = (across >= 0).all(axis=1)
    alike = (label[across] == label[:, None]).all(axis=1)
    inside = np.flatnonzero(whole & alike & (label > 0))[0]
    border = np.flatnonzero(whole & ~alike & (label > 0))[-1]
    assert border not in across[inside]
    guessed = np.zeros(len(mesh.faces), dtype=np.bool_)
    guessed[[inside, border]] = True
    part = replace(plain, face_instance=label[~guessed], face_score=plain.face_score[~guessed])
    found = with_guesses(part, replace(mesh, guessed=guessed))
    assert found.face_instance[inside] == label[inside]
    assert found.face_instance[border] == 0
    assert found.face_score[[inside, border]].tolist() == [0.0, 0.0]
    assert np.array_equal(found.face_instance[~guessed], label[~guessed])
