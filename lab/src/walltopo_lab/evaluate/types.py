"""Comparison of the type network's hold types with the true ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.types import TypeModel, reliefs
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import UNKNOWN
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.routes import match_pairs, type_of_kind
from walltopo_lab.evaluate.scan import measured_labels, scan_views
from walltopo_lab.evaluate.truth import TrueInstance, read_truth

Key = tuple[str, int]  # gym name and hold id
HOLD = 1  # class id in the truth
WITHIN = 0.02  # metres over which labels are carried between meshes


@dataclass
class Named:
    """The predictions of the type network for some holds.

    Parameters
    ----------
    answers : the type, or "unknown", and the network's confidence.
    truth : the true type of each hold.
    """

    answers: dict[Key, tuple[str, float]] = field(default_factory=dict)
    truth: dict[Key, str] = field(default_factory=dict)

    def add(self, gym: str, answers: dict[int, tuple[str, float]], truth: dict[int, str]) -> None:
        """Add the holds of another gym."""
        self.answers |= {(gym, number): answer for number, answer in answers.items()}
        self.truth |= {(gym, number): truth[number] for number in answers}


def true_types(instances: Mapping[int, TrueInstance]) -> dict[int, str]:
    """Return the type of each hold; volumes have none."""
    holds = (one for one in instances.values() if one.label == HOLD)
    return {one.id: type_of_kind(one.kind) for one in holds}


def answers_of(
    model: TypeModel, mesh: Mesh, labels: NDArray[np.int32], ids: Sequence[int]
) -> dict[int, tuple[str, float]]:
    """Return the network's type and confidence for each instance that has triangles.

    Parameters
    ----------
    mesh : in metres; labels : (F,) the instance of each face.
    """
    shapes = measure_shapes(mesh, labels, list(ids))
    looks = reliefs(mesh, labels, shapes, 1.0)
    named = dict(zip(looks, model.names_of(list(looks.values())), strict=True))
    return {number: named.get(number, (UNKNOWN, 0.0)) for number in shapes}


def _on_scan(model: TypeModel, gym: Path, folder: Path, whole: Named, met: Named) -> None:
    truth, scan = read_truth(gym), ScanFolder(folder)
    motion = align_views(scan_views(scan, truth), truth.views, False)
    spanned = read_mesh(scan.mesh)
    mesh = motion.mesh(spanned.without_guesses())
    types = true_types(truth.instances)
    carried = carry_truth(truth, mesh, WITHIN)
    labels = carried.labelled.face_instance
    there = sorted(set(np.unique(labels).tolist()) & set(types))
    whole.add(gym.name, answers_of(model, mesh, labels, there), types)
    lifted = measured_labels(scan, spanned)
    pairs = match_pairs(overlap_with_missing(lifted, carried, mesh.areas, truth))
    mine = {found: number for found, number in pairs.items() if number in types}
    answers = answers_of(model, mesh, lifted.face_instance, sorted(mine))
    met.add(gym.name, {mine[found]: answer for found, answer in answers.items()}, types)


def name_types_on_scans(
    model: TypeModel, scans: Sequence[tuple[Path, Path]], certain: float | None = None
) -> tuple[Named, Named]:
    """Return the network's types of holds on reconstructed meshes.

    Parameters
    ----------
    scans : gyms with truth, and scans of their photos, finished up to `lift`.
    certain : a minimum probability that overrides the network's own.

    Returns
    -------
    The predictions for true instances carried onto the scans' meshes, and for lifted instances that
    match a true one at an IoU over .5.
    """
    model = model if certain is None else replace(model, certain=certain)
    whole, met = Named(), Named()
    for gym, folder in scans:
        _on_scan(model, gym, folder, whole, met)
    return whole, met
