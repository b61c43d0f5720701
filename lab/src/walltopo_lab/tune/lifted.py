"""Repeated lifts of one wall with other settings, which recompute only the affected steps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from typing import Any

from walltopo.core import Instances, Mesh, Silent, View
from walltopo.geometry.graphs import louvain
from walltopo.segment.lift import LiftParams
from walltopo.segment.lift.distance import resolve_lengths
from walltopo.segment.lift.evidence import Sampling
from walltopo.segment.lift.fast import (
    best_cluster,
    keep_faces,
    literal_clusters,
    literal_graph,
    literal_instances,
)
from walltopo.segment.lift.label_image import drawing_order
from walltopo.segment.lift.robust import robust_instances
from walltopo.segment.lift.similarity import compare_projections
from walltopo.segment.lift.vote import tidy_order
from walltopo_lab.tune.seen import SeenOnce


class Lifted:
    """A wall's lift that caches its steps.

    Each step is cached for the last values of the settings that it depends on. One set of evidence
    takes hundreds of megabytes at a million faces, and a search seldom returns to earlier settings.

    Parameters
    ----------
    farthest : the largest visibility distance that will be requested, metres.
    widest : the largest border band that will be requested, pixels.

    Attributes
    ----------
    done : number of computations of each step.
    """

    def __init__(
        self, mesh: Mesh, views: tuple[View, ...], farthest: float, widest: float = 0.0
    ) -> None:
        self._mesh, self._views = mesh, views
        self._farthest, self._widest = farthest, widest
        self._kept: dict[str, tuple[Hashable, Any]] = {}
        self.done: Counter[str] = Counter()

    def _step(self, name: str, key: Hashable, compute: Callable[[], Any]) -> Any:
        kept = self._kept.get(name)
        if kept is None or kept[0] != key:
            self._kept[name] = kept = (key, compute())
            self.done[name] += 1
        return kept[1]

    def __call__(self, params: LiftParams) -> Instances:
        """Return the result of `walltopo.segment.lift.lift` for these settings."""
        if params.normalised:
            params = resolve_lengths(params, self._mesh, self._views)
        self._farthest = max(self._farthest, params.visibility_distance)
        self._widest = max(self._widest, params.border_band)
        return self._literal(params) if params.method == "literal" else self._robust(params)

    def _literal(self, params: LiftParams) -> Instances:
        on_top = params.on_top
        look = "literal", self._farthest, params.mask_resolution, on_top
        sampling = Sampling(self._farthest, 0.0, params.mask_resolution)
        seen: SeenOnce = self._step(
            "look",
            look,
            lambda: SeenOnce(self._mesh, self._views, lambda v: drawing_order(v, on_top), sampling),
        )
        distance, power = params.visibility_distance, params.easing_power
        weigh = *look, distance, power
        evidence = self._step("weigh", weigh, lambda: seen.evidence(distance, power))
        graph = self._step("compare", weigh, lambda: literal_graph(evidence))
        parted = *weigh, params.resolution, params.seed
        cluster = self._step(
            "cluster", parted, lambda: literal_clusters(evidence, params, louvain, graph)
        )
        self.done["decide"] += 1
        kept = keep_faces(evidence, cluster, params.threshold)
        winner, shares = best_cluster(kept, len(evidence.faces))
        return literal_instances(
            evidence, cluster, winner, shares, len(self._mesh.faces), params.confidence
        )

    def _robust(self, params: LiftParams) -> Instances:
        drop, on_top = params.drop_duplicates, params.on_top
        look = (
            "robust",
            self._farthest,
            self._widest,
            params.mask_resolution,
            params.sample_px,
            params.max_splits,
            drop,
            on_top,
        )
        sampling = Sampling(
            self._farthest,
            0.0,
            params.mask_resolution,
            self._widest,
            params.sample_px,
            params.max_splits,
        )
        seen: SeenOnce = self._step(
            "look",
            look,
            lambda: SeenOnce(
                self._mesh, self._views, lambda v: tidy_order(v, on_top, drop), sampling
            ),
        )
        # Distance alone decides which views contribute: this method ignores the easing weight.
        distance, band = params.visibility_distance, params.border_band
        weigh = *look, distance, band
        evidence = self._step("weigh", weigh, lambda: seen.evidence(distance, 0.0, band))
        pairs = self._step("compare", (*look, distance), lambda: compare_projections(evidence))
        self.done["decide"] += 1
        return robust_instances(self._mesh, evidence, pairs, params, Silent())
