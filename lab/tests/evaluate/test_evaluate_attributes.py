"""Colours and types of a scan against the truth."""

from __future__ import annotations

import pytest

from walltopo.scans.holds import Hold
from walltopo_lab.evaluate.routes import attribute_metrics
from walltopo_lab.evaluate.truth import TrueInstance


def true_hold(number: int, kind: str, *colours: str) -> TrueInstance:
    names = colours or ("red",)
    label = 2 if kind == "volume" else 1
    return TrueInstance(number, label, kind, names[0], 0, (0, 0, 0), (0, -1, 0), names)


def test_types_named_and_right() -> None:
    kinds = ("jug", "foot", "crimp", "pinch", "volume")
    truth = {k: true_hold(k, kind) for k, kind in enumerate(kinds, start=1)}
    shown = {11: "jug", 12: "foothold", 13: "sloper", 14: "unknown", 15: "volume"}
    holds = [Hold(k, "hold", type=name, colour="red") for k, name in shown.items()]
    figures = attribute_metrics(holds, {k: k - 10 for k in shown}, truth)
    assert figures["type_named"] == pytest.approx(3 / 4)  # volumes are no holds
    assert figures["type_accuracy"] == pytest.approx(2 / 3)  # a foot is a foothold
    assert figures["type_unknown"] == 1


def test_both_names_of_a_two_coloured_hold_count_in_either_order() -> None:
    truth = {1: true_hold(1, "jug"), 2: true_hold(2, "jug"), 3: true_hold(3, "jug", "red", "white")}
    truth |= {4: true_hold(4, "jug", "red", "white"), 5: true_hold(5, "jug", "red", "white")}
    names = {
        1: ("red", ""),
        2: ("red", "blue"),
        3: ("white", "red"),
        4: ("white", ""),
        5: ("blue", ""),
    }
    holds = [Hold(k, "hold", colour=a, second_colour=b) for k, (a, b) in names.items()]
    figures = attribute_metrics(holds, {k: k for k in names}, truth)
    assert figures["colour_accuracy"] == pytest.approx(4 / 5)
    assert figures["both_colours"] == pytest.approx(1 / 3)
    assert figures["called_two_coloured"] == 1


def test_nothing_matched_gives_no_figures() -> None:
    figures = attribute_metrics([], {}, {})
    assert figures["type_named"] is None
    assert figures["type_accuracy"] is None
