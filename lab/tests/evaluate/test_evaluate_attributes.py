"""Colours and types of a scan against the truth."""

from __future__ import annotations

import pytest

from walltopo.scans.holds import Hold
from walltopo_lab.evaluate.routes import attribute_metrics
from walltopo_lab.evaluate.truth import TrueInstance


def true_hold(number: int, kind: str) -> TrueInstance:
    label = 2 if kind == "volume" else 1
    return TrueInstance(number, label, kind, "red", 0, (0, 0, 0), (0, -1, 0))


def test_types_named_and_right() -> None:
    kinds = ("jug", "foot", "crimp", "pinch", "volume")
    truth = {k: true_hold(k, kind) for k, kind in enumerate(kinds, start=1)}
    shown = {11: "jug", 12: "foothold", 13: "sloper", 14: "unknown", 15: "volume"}
    holds = [Hold(k, "hold", type=name, colour="red") for k, name in shown.items()]
    figures = attribute_metrics(holds, {k: k - 10 for k in shown}, truth)
    assert figures["type_named"] == pytest.approx(3 / 4)  # volumes are no holds
    assert figures["type_accuracy"] == pytest.approx(2 / 3)  # a foot is a foothold
    assert figures["type_unknown"] == 1


def test_nothing_matched_gives_no_figures() -> None:
    figures = attribute_metrics([], {}, {})
    assert figures["type_named"] is None
    assert figures["type_accuracy"] is None
