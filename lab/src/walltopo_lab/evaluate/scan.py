"""Evaluation of a scan folder against ground truth: the metrics of every stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import InputError, Mesh, Progress, Silent, View
from walltopo.geometry.mesh_files import read_mesh
from walltopo.geometry.similarity import Similarity
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.photos import PhotoList
from walltopo.scans.routes import Routes
from walltopo.scans.scale import Scale
from walltopo_lab.evaluate.align import align_views, pose_metrics
from walltopo_lab.evaluate.carry import (
    Carried,
    carry_prediction,
    carry_truth,
    overlap_with_missing,
)
from walltopo_lab.evaluate.errors_mesh import coloured_mesh, outcome_of_faces
from walltopo_lab.evaluate.instances import summarise_instances
from walltopo_lab.evaluate.mesh import REACH_M, mesh_metrics
from walltopo_lab.evaluate.operating import keep_instances, operating_point
from walltopo_lab.evaluate.overlap import Labelled, overlap_of_faces
from walltopo_lab.evaluate.routes import attribute_metrics, match_pairs, route_metrics
from walltopo_lab.evaluate.semantics import class_of_faces, confusion, semantic_metrics
from walltopo_lab.evaluate.truth import Truth

CLASSES = 3  # none, hold, volume


@dataclass(frozen=True, eq=False)
class ScanEvaluation:
    """The metrics of a scan after one fit, and the mesh that shows its errors.

    Parameters
    ----------
    figures : JSON-able, by section: poses, mesh, instances, shown, semantics, attributes, routes.
        Sections whose stage has not run are absent.
    errors : the scan's mesh in the truth's frame, coloured by outcome; None without instances.

    Notes
    -----
    `instances` ranks every instance that the lift found, as an AP requires. All other sections and
    the coloured mesh cover only the instances that the scan shows as holds, without the
    low-confidence ones that it only lists. `semantics_all` is the mIoU of every instance.
    """

    figures: dict[str, Any]
    errors: Mesh | None


def read_labelled(npz: Path, records: Path) -> Labelled:
    """Return the instances of a scan from `instances.npz` and `instances.json`."""
    rows = InstanceRecords.load(records).instances
    return Labelled(
        InstanceTable.load(npz).face_instance,
        {row.id: row.label for row in rows},
        {row.id: row.confidence for row in rows},
    )


def measured_labels(scan: ScanFolder, whole: Mesh) -> Labelled:
    """Return the instances of a scan on the measured triangles of its mesh, without guessed
    surface.

    Parameters
    ----------
    whole : the mesh as stored in the scan; the labels follow the order of its `without_guesses()`.

    Raises
    ------
    InputError : the instances belong to another mesh.
    """
    found = read_labelled(scan.instances, scan.instance_records)
    if len(found.face_instance) != len(whole.faces):
        raise InputError(
            f"{scan.instances}: {len(found.face_instance)} faces, but {scan.mesh} has "
            f"{len(whole.faces)}",
            "Run the lift again on this mesh.",
        )
    return replace(found, face_instance=found.face_instance[whole.measured])


def scan_views(scan: ScanFolder, truth: Truth) -> dict[str, View]:
    """Return the scan's views by the truth's photo names.

    Ingest may rename photos (another suffix, a clean name); `photos.json` records their source.
    """
    sources: dict[str, str] = {}
    if scan.photo_list.is_file():
        for photo in PhotoList.load(scan.photo_list).photos:
            sources[photo.name] = Path(photo.source).stem
    by_stem = {Path(name).stem: name for name in truth.views}
    views: dict[str, View] = {}
    for view in read_views(scan.sparse):
        stem = sources.get(view.name, Path(view.name).stem)
        views[by_stem.get(stem, view.name)] = view
    return views


def is_metric(scan: ScanFolder) -> bool:
    """Return whether the scan's `scale.json` states metres."""
    return scan.scale.is_file() and Scale.load(scan.scale).metric


def evaluate_scan(
    scan: ScanFolder,
    truth: Truth,
    *,
    similarity: bool,
    within: float = 0.02,
    progress: Progress | None = None,
) -> ScanEvaluation:
    """Compare all results of a scan with the truth.

    Parameters
    ----------
    similarity : fit scale, rotation and translation to the true camera centres, instead of only
        heading and position on the floor.
    within : distance over which labels are carried between the meshes, metres.

    Raises
    ------
    InputError : the scan has no cameras or mesh, or shares no photos with the truth.
    """
    listener = progress or Silent()
    figures: dict[str, Any] = {"fit": "similarity" if similarity else "heading and place"}
    transform: Similarity | None = None
    if truth.views:
        listener.step("cameras")
        views = scan_views(scan, truth)
        figures["poses"] = pose_metrics(views, truth.views, similarity)
        transform = align_views(views, truth.views, similarity)
    if not scan.mesh.is_file():
        return ScanEvaluation(figures, None)
    listener.step("mesh")
    whole = read_mesh(scan.mesh)
    mesh = whole.without_guesses()
    mesh = transform.mesh(mesh) if transform else mesh
    carried = carry_truth(truth, mesh, within, REACH_M)
    figures["mesh"] = mesh_metrics(mesh, truth, carried)
    if not scan.instances.is_file():
        return ScanEvaluation(figures, None)
    listener.step("instances")
    predicted = measured_labels(scan, whole)
    shown = _shown_instances(scan, predicted)
    _rank_figures(figures, mesh, predicted, carried, truth, within)
    pairs = _shown_figures(figures, mesh, shown, carried, truth, within)
    _route_figures(figures, scan, pairs, truth)
    outcomes = outcome_of_faces(
        shown.face_instance, carried.labelled.face_instance, pairs, carried.ignored
    )
    return ScanEvaluation(figures, coloured_mesh(mesh, outcomes))


def _shown_instances(scan: ScanFolder, predicted: Labelled) -> Labelled:
    """Return the instances that the scan shows as holds; all of them before `classify` has run."""
    if not scan.holds.is_file():
        return predicted
    return keep_instances(predicted, {hold.id for hold in Holds.load(scan.holds).holds})


def _rank_figures(
    figures: dict[str, Any],
    mesh: Mesh,
    predicted: Labelled,
    carried: Carried,
    truth: Truth,
    within: float,
) -> None:
    overlap = overlap_with_missing(predicted, carried, mesh.areas, truth)
    figures["instances"] = summarise_instances([overlap]).as_dict()
    on_truth = carry_prediction(mesh, predicted, truth, within)
    exact = overlap_of_faces(on_truth, truth.labelled, truth.mesh.areas, truth.ignored)
    figures["instances_on_true_mesh"] = summarise_instances([exact]).as_dict()
    figures["semantics_all"] = _semantic_miou(predicted, carried, mesh)


def _shown_figures(
    figures: dict[str, Any],
    mesh: Mesh,
    shown: Labelled,
    carried: Carried,
    truth: Truth,
    within: float,
) -> Mapping[int, int]:
    overlap = overlap_with_missing(shown, carried, mesh.areas, truth)
    figures["shown"] = operating_point([overlap]).as_dict()
    figures["semantics"] = _semantic_miou(shown, carried, mesh)
    on_truth = carry_prediction(mesh, shown, truth, within)
    seen = np.where(truth.ignored, 0.0, truth.mesh.areas)
    table = confusion(class_of_faces(on_truth), class_of_faces(truth.labelled), seen, CLASSES)
    figures["semantics_on_true_mesh"] = semantic_metrics([table]).as_dict()
    return match_pairs(overlap)


def _semantic_miou(labelled: Labelled, carried: Carried, mesh: Mesh) -> dict[str, Any]:
    """Return the mIoU on the scan's mesh, without surface that no photo saw."""
    counted = np.where(carried.ignored, 0.0, mesh.areas)
    table = confusion(class_of_faces(labelled), class_of_faces(carried.labelled), counted, CLASSES)
    return semantic_metrics([table]).as_dict()


def _route_figures(
    figures: dict[str, Any], scan: ScanFolder, pairs: Mapping[int, int], truth: Truth
) -> None:
    if not truth.instances:
        return
    if scan.holds.is_file():
        holds = Holds.load(scan.holds).holds
        figures["attributes"] = attribute_metrics(holds, pairs, truth.instances)
    if scan.routes.is_file():
        routes = Routes.load(scan.routes).routes
        figures["routes"] = route_metrics(routes, pairs, truth.instances)
