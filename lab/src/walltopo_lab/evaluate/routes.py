"""Metrics of the grouping of holds into routes, and of hold colours and types."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from walltopo.scans.holds import UNKNOWN, Hold
from walltopo.scans.routes import Route
from walltopo_lab.evaluate.overlap import Overlap
from walltopo_lab.evaluate.truth import CLASS_IDS, TrueInstance


def match_pairs(overlap: Overlap, threshold: float = 0.5) -> dict[int, int]:
    """Return predicted id to true id of pairs with IoU over the threshold (>= .5: one-to-one)."""
    iou = overlap.iou()
    if iou.size == 0:
        return {}
    best = iou.argmax(axis=1)
    return {
        int(overlap.pred_ids[p]): int(overlap.truth_ids[t])
        for p, t in enumerate(best)
        if iou[p, t] > threshold
    }


def grouping_scores(truth: Sequence[int], predicted: Sequence[int]) -> dict[str, float]:
    """Return the adjusted Rand index, homogeneity and completeness of a grouping."""
    from sklearn.metrics import adjusted_rand_score, completeness_score, homogeneity_score

    return {
        "ari": float(adjusted_rand_score(truth, predicted)),
        "homogeneity": float(homogeneity_score(truth, predicted)),
        "completeness": float(completeness_score(truth, predicted)),
    }


def route_metrics(
    routes: Sequence[Route],
    pairs: Mapping[int, int],
    truth: Mapping[int, TrueInstance],
) -> dict[str, Any]:
    """Return the grouping scores over the matched holds that belong to a true route.

    Volumes belong to all routes and downclimb holds to none, so both are excluded. A hold without a
    predicted route counts as a group of its own.

    Parameters
    ----------
    routes : the routes of `routes.json`.
    pairs : predicted id to true id, see `match_pairs`.
    truth : true instances by id.
    """
    route_of: dict[int, int] = {}
    for route in routes:
        for hold in route.holds:
            route_of.setdefault(hold, route.id)
    holds = [(p, t) for p, t in sorted(pairs.items()) if truth[t].route >= 0]
    true_groups = [truth[t].route for _, t in holds]
    # Negative ids cannot clash with route ids.
    found_groups = [route_of.get(p, -1 - p) for p, _ in holds]
    downclimb = [p for p, t in pairs.items() if truth[t].route == -2]
    result: dict[str, Any] = {
        "holds_compared": len(holds),
        "holds_unrouted": sum(p not in route_of for p, _ in holds),
        "routes_true": len(set(true_groups)),
        "routes_found": len(routes),
        "downclimb_holds": len(downclimb),
        "downclimb_kept_out": sum(p not in route_of for p in downclimb),
    }
    if len(holds) < 2:
        return {**result, "ari": None, "homogeneity": None, "completeness": None}
    return result | grouping_scores(true_groups, found_groups)


def type_of_kind(kind: str) -> str:
    """Return the scan's word for a kind of hold in `scene.json`."""
    return "foothold" if kind == "foot" else kind


def attribute_metrics(
    found: Sequence[Hold],
    pairs: Mapping[int, int],
    truth: Mapping[int, TrueInstance],
) -> dict[str, Any]:
    """Return the share of matched instances with the right colour, type and class.

    Types are compared on holds only, and "unknown" counts apart from wrong. `type_named` is the
    share of holds with a type, `type_accuracy` the share of typed holds with the right one. The
    colour of a two-coloured hold is right if the hold has it; `both_colours` is the share of the
    two-coloured holds of which both names are right, `called_two_coloured` counts the others that
    have a second name.

    Parameters
    ----------
    found : the instances of `holds.json`.
    """
    by_id = {hold.id: hold for hold in found}
    both = [(by_id[p], truth[t]) for p, t in sorted(pairs.items()) if p in by_id]
    holds = [(mine, true) for mine, true in both if true.label == 1]
    typed = [(mine, true) for mine, true in holds if mine.type != UNKNOWN]

    def share(rows: Sequence[bool]) -> float | None:
        return float(np.mean(rows)) if rows else None

    return {
        "compared": len(both),
        "colour_accuracy": share([mine.colour in true.colours for mine, true in holds]),
        "both_colours": share(
            [
                set(mine.colours) == set(true.colours)
                for mine, true in holds
                if len(true.colours) > 1
            ]
        ),
        "called_two_coloured": sum(
            len(mine.colours) > 1 for mine, true in holds if len(true.colours) == 1
        ),
        "type_named": len(typed) / len(holds) if holds else None,
        "type_accuracy": share([mine.type == type_of_kind(true.kind) for mine, true in typed]),
        "type_unknown": len(holds) - len(typed),
        "class_accuracy": share([CLASS_IDS.get(mine.kind) == true.label for mine, true in both]),
    }
