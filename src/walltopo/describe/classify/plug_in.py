"""Classifiers of cutouts join by entry points: they name types and colours of holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import entry_points
from typing import Protocol

from walltopo.core import EnvironmentLacksError, SettingsError
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import Entry
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.scans.attributes import Hold

# Name -> a class that is made from `ClassifySettings`; walltopo-lab has one.
ENTRY_POINTS = "walltopo.classifiers"


class Classifier(Protocol):
    """What a plug-in does with the holds of a scan."""

    def holds(
        self, holds: Sequence[Hold], seen: Mapping[int, Sequence[HoldView]]
    ) -> Sequence[Hold]:
        """Return the holds as the classifier names them; `seen` has their cutouts by id."""

    def palette(self, entries: Sequence[Entry], holds: Sequence[Hold]) -> Sequence[Entry]:
        """Return the palette with the colours that only the classifier names."""


def classifier_of(settings: ClassifySettings) -> Classifier | None:
    """Return the classifier for `settings.model`; None where types come from the shape.

    Raises
    ------
    EnvironmentLacksError : no plug-in is installed. InputError : the model cannot be used.
    """
    if not settings.model:
        if settings.classes:
            raise SettingsError(
                "classify.classes tells what classify.model's classes mean, but no model is given"
            )
        return None
    for point in entry_points(group=ENTRY_POINTS):
        found: Classifier = point.load()(settings)
        return found
    raise EnvironmentLacksError(
        "classify.model needs a classifier of cutouts, and none is installed",
        "pip install walltopo-lab",
    )
