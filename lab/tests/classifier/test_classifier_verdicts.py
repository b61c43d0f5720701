"""The classify stage applies a classifier's verdicts to holds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace as with_

from walltopo.core import InputError, SettingsError
from walltopo.describe.classify.attributes import classifier_of
from walltopo.describe.classify.observations import HoldView, _occluded_share
from walltopo.describe.classify.palette import Entry
from walltopo.describe.settings import ClassifySettings
from walltopo.scans.holds import Hold
from walltopo_lab.classifier.cutout_classifier import Meaning, Verdict
from walltopo_lab.classifier.verdicts import (
    apply_verdict,
    apply_verdicts,
    classify_cutouts,
    cutout_weights,
    with_class_colours,
)

HOLD = Hold(3, "hold", position=(0, 0, 1), type="crimp", colour="red", colour_confidence=0.9)


def view(colour: tuple[int, int, int], pixels: int = 100, **changes: object) -> HoldView:
    crop = np.full((10, 10, 3), colour, np.uint8)
    mask = np.ones((10, 10), np.bool_)
    plain = HoldView(0, 3, pixels, 0.0, np.zeros(3), 50.0, False, crop, mask)
    return replace(plain, **changes)  # type: ignore[arg-type]


class ByColour:
    """Stands for a network: red pictures are jugs, others pinches."""

    names = ("jug", "pinch")
    side = 32
    certain = 0.0

    def meaning(self, name: str) -> Meaning:
        return Meaning(name, "red" if name == "jug" else "")

    def confidences(self, pictures: np.ndarray) -> np.ndarray:
        red = pictures[:, 16, 16, 0] > 150
        return np.where(red[:, None], [[0.9, 0.1]], [[0.3, 0.7]])


def test_area_or_sharp_area() -> None:
    views = [
        view((0, 0, 0)),
        view((0, 0, 0), sharpness=10.0),
        view((0, 0, 0), cut=True),
        view((0, 0, 0), hidden=0.25),
        view((0, 0, 0), clipped=1.0),
    ]
    assert cutout_weights(views, "area").tolist() == [100.0] * 5
    assert cutout_weights(views, "sharp") == pytest.approx([100, 20, 50, 50, 10])


def test_the_published_weight_is_the_box_and_counts_every_cutout() -> None:
    mask = np.zeros((10, 10), np.bool_)
    mask[2:4, 1:9] = mask[2:8, 1:2] = True  # 20 pixels of the crop in a box of 6 x 8
    views = [view((0, 0, 0)), view((0, 0, 0), mask=mask, pixels=80)]
    assert cutout_weights(views, "box").tolist() == [100.0, 80 * 48 / 20]
    # Twenty small blue cutouts outweigh a red one; the heaviest two do not.
    seen = {3: [view((200, 0, 0), 900), *(view((0, 0, 200), 290) for _ in range(20))]}
    assert classify_cutouts(ByColour(), seen, "box", 2)[3].name == "pinch"  # type: ignore[arg-type]
    assert classify_cutouts(ByColour(), seen, "area", 2)[3].name == "jug"  # type: ignore[arg-type]


def test_the_heaviest_cutouts_decide() -> None:
    """One large red cutout against two small blue ones."""
    seen = {3: [view((200, 0, 0), 900), view((0, 0, 200), 50), view((0, 0, 200), 50)], 4: []}
    found = classify_cutouts(ByColour(), seen, "area", 12)  # type: ignore[arg-type]
    assert list(found) == [3]
    assert found[3].name == "jug"
    assert found[3].confidence == pytest.approx((0.84 - 0.16) * 0.9)
    alone = classify_cutouts(ByColour(), seen, "area", 1)  # type: ignore[arg-type]
    assert alone[3].confidence == pytest.approx(0.8)


def test_a_hold_follows_its_class() -> None:
    sure = Verdict("x", 0.8)
    jug = apply_verdict(HOLD, sure, Meaning("jug"), 0.5)
    assert (jug.type, jug.type_confidence, jug.colour) == ("jug", 0.8, "red")
    assert (jug.role, jug.review) == ("hold", False)
    blue = apply_verdict(HOLD, sure, Meaning("unknown", "blue"), 0.5)
    assert (blue.type, blue.colour, blue.colour_confidence) == ("crimp", "blue", 0.8)
    assert apply_verdict(HOLD, sure, Meaning("jug", role="downclimb"), 0.5).role == "downclimb"
    volume = with_(HOLD, kind="volume", role="volume", type="volume")
    assert apply_verdict(volume, sure, Meaning("jug"), 0.5) == volume


def test_what_is_not_certain_is_unknown() -> None:
    doubted = apply_verdict(HOLD, Verdict("x", 0.4), Meaning("jug", "blue", "downclimb"), 0.5)
    assert (doubted.type, doubted.type_confidence) == ("unknown", 0.0)
    assert (doubted.colour, doubted.role) == ("red", "hold")


def test_what_the_model_doubts_is_for_review() -> None:
    """Hold 3 has a doubtful colour, which the class knows; hold 4 an undecided type."""
    holds = [with_(HOLD, review=True), with_(HOLD, id=4)]
    undecided = [view((200, 0, 0)), view((0, 0, 200))]
    seen = {3: [view((200, 0, 0))], 4: undecided}
    settings = ClassifySettings(model="my.onnx", review_below=0.3, cutout_weight="area")
    found = apply_verdicts(holds, seen, ByColour(), settings)  # type: ignore[arg-type]
    assert [hold.id for hold in found if hold.review] == [4]


def test_colours_that_only_classes_name_join_the_palette() -> None:
    palette = [Entry("red", (200, 0, 0))]
    holds = [HOLD, with_(HOLD, colour="neon", colour_rgb=(10, 250, 10))]
    assert [e.name for e in with_class_colours(palette, holds)] == ["red", "neon"]
    assert with_class_colours(palette, holds)[1].rgb == (10, 250, 10)


def test_which_classifier_the_settings_name(tmp_path: Path) -> None:
    assert classifier_of(ClassifySettings()) is None
    with pytest.raises(SettingsError, match=r"classify\.classes"):
        classifier_of(ClassifySettings(classes=str(tmp_path / "classes.toml")))
    with pytest.raises(InputError, match="model"):
        classifier_of(ClassifySettings(model=str(tmp_path / "none.onnx")))


def test_what_is_in_front_hides_a_hold() -> None:
    """The left neighbours of a square are nearer than it, the rest is the wall behind."""
    mask = np.zeros((7, 7), np.bool_)
    mask[2:5, 2:5] = True
    depth = np.where(mask, 2.0, 2.05).astype(np.float32)
    assert _occluded_share(mask, depth) == 0
    depth[:, :2] = 1.5
    assert _occluded_share(mask, depth) == pytest.approx(5 / 16)
    assert _occluded_share(np.ones((3, 3), np.bool_), depth[:3, :3]) == 0
