"""Application of a cutout classifier to the holds of a scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import Entry
from walltopo.describe.settings import ClassifySettings
from walltopo.scans.holds import UNKNOWN, Hold
from walltopo_lab.classifier.cutout_classifier import (
    CutoutClassifier,
    Meaning,
    Verdict,
    judge_cutouts,
    open_classifier,
    read_classes,
    square_cutout,
)

MAX_CUTOUTS = 12  # cutouts of one hold that are classified


class OnCutouts:
    """The plug-in of `walltopo.classifiers` for types and colours of holds from their cutouts.

    Raises
    ------
    InputError : the model or the file of classes is invalid.
    """

    def __init__(self, settings: ClassifySettings) -> None:
        classes = read_classes(Path(settings.classes)) if settings.classes else None
        self._classifier = open_classifier(Path(settings.model), classes)
        self._settings = settings

    def holds(
        self, holds: Sequence[Hold], seen: Mapping[int, Sequence[HoldView]]
    ) -> Sequence[Hold]:
        """Return the holds with the classifier's types and colours."""
        return apply_verdicts(holds, seen, self._classifier, self._settings)

    def palette(self, entries: Sequence[Entry], holds: Sequence[Hold]) -> Sequence[Entry]:
        """Return the palette with the additional colours that classes name."""
        return with_class_colours(entries, holds)


def cutout_weights(views: Sequence[HoldView], weighting: str) -> NDArray[np.float64]:
    """Return (n,) weights of a hold's cutouts.

    Parameters
    ----------
    weighting : "area": visible pixels; "sharp": visible pixels, reduced if the cutout is blurred
        relative to the hold's others, clipped, overexposed, or partly occluded; "box": width
        times height of the visible pixels' box (the publication's Algorithm 8).
    """
    if weighting == "box":
        return np.array([_box_area(view) for view in views])
    if weighting == "area":
        return np.array([float(view.pixels) for view in views])
    usual = max(float(np.median([view.sharpness for view in views])), 1e-9)
    return np.array(
        [
            view.quality * min(1.0, view.sharpness / usual) * (1 - min(1.0, 2 * view.hidden))
            for view in views
        ]
    )


def _box_area(view: HoldView) -> float:
    """Return the pixels of the photo in the bounding box of a hold's visible pixels."""
    rows, columns = np.nonzero(view.mask)
    box = (np.ptp(rows) + 1.0) * (np.ptp(columns) + 1.0)
    return float(view.pixels * box / len(rows))  # the crop is downscaled, `pixels` is not


def classify_cutouts(
    classifier: CutoutClassifier,
    seen: Mapping[int, Sequence[HoldView]],
    weighting: str,
    most: int = MAX_CUTOUTS,
) -> dict[int, Verdict]:
    """Return the class of each hold that a photo shows.

    Parameters
    ----------
    seen : hold id to its cutouts.
    most : maximum number of cutouts, by weight; the weighting "box" uses all of them.
    """
    found: dict[int, Verdict] = {}
    for hold, views in seen.items():
        shown = [view for view in views if view.mask.any()]
        if not shown:
            continue
        weights = cutout_weights(shown, weighting)
        best = np.argsort(-weights, kind="stable")[: None if weighting == "box" else most]
        pictures = [square_cutout(shown[k].crop, shown[k].mask, classifier.side) for k in best]
        confidences = classifier.confidences(np.stack(pictures))
        found[hold] = judge_cutouts(confidences, weights[best], classifier.names)
    return found


def apply_verdict(hold: Hold, verdict: Verdict, meaning: Meaning, certain: float) -> Hold:
    """Return the hold with a verdict's attributes; attributes that the class lacks are kept.

    Below `certain` the type is "unknown" and all other attributes are kept.
    """
    if hold.kind == "volume":
        return hold
    if verdict.confidence < certain:
        return replace(hold, type=UNKNOWN, type_confidence=0.0)
    changes: dict[str, object] = {}
    if meaning.type != UNKNOWN:
        changes |= {"type": meaning.type, "type_confidence": verdict.confidence}
    if meaning.colour:
        changes |= {"colour": meaning.colour, "colour_confidence": verdict.confidence}
    if meaning.role != "hold":
        changes["role"] = meaning.role
    return replace(hold, **changes)


def apply_verdicts(
    holds: Sequence[Hold],
    seen: Mapping[int, Sequence[HoldView]],
    classifier: CutoutClassifier,
    settings: ClassifySettings,
) -> list[Hold]:
    """Return all holds with the classifier's attributes; holds in no photo are unchanged.

    Low-confidence holds are marked for review.
    """
    by_hold = classify_cutouts(classifier, seen, settings.cutout_weight)
    result = []
    for hold in holds:
        verdict = by_hold.get(hold.id)
        if verdict is not None:
            meaning = classifier.meaning(verdict.name)
            doubtful = verdict.confidence < settings.review_below
            hold = apply_verdict(hold, verdict, meaning, classifier.certain)
            if hold.kind != "volume":
                # The class names the colour, so the palette's low confidence no longer matters.
                names_colour = bool(meaning.colour) and not doubtful
                hold = replace(hold, review=doubtful or (hold.review and not names_colour))
        result.append(hold)
    return result


def with_class_colours(palette: Sequence[Entry], holds: Sequence[Hold]) -> list[Entry]:
    """Return the palette plus the colours of classes alone, as the median of their holds."""
    known = {entry.name for entry in palette} | {UNKNOWN}
    added = []
    for name in dict.fromkeys(hold.colour for hold in holds if hold.colour not in known):
        rgb = np.median([hold.colour_rgb for hold in holds if hold.colour == name], axis=0)
        added.append(Entry(name, (round(rgb[0]), round(rgb[1]), round(rgb[2]))))
    return [*palette, *added]
