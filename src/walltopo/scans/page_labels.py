"""`page/labels.json`: what the page's tiers lack, so that an edit rewrites no geometry."""

from __future__ import annotations

from typing import Annotated

import msgspec

from walltopo.scans.document import Document, Label
from walltopo.scans.edits import Place
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

Step = Annotated[float, msgspec.Meta(gt=0, le=1e6)]


class LabelledPlaces(msgspec.Struct, frozen=True):
    """Triangles of the mesh with one label, each by its centroid.

    Parameters
    ----------
    label : their hold, 0 = wall.
    places : x, y, z of each in steps from the previous one; the first from `origin`.
    """

    label: Label
    places: tuple[int, ...]


class SurfaceLabels(msgspec.Struct, frozen=True):
    """The rules for the hold at each place of a tier.

    A tier's vertices carry patch numbers. A patch is an instance before any edit, 0 is the wall. By
    default, a patch is shown as the hold with its number.

    Parameters
    ----------
    patches : patch and label, for patches shown as another hold, or as wall (0).
    changed : triangles of the mesh whose label differs from that of their patch.
    unchanged : centroids of the triangles around those, coded as in `LabelledPlaces`: a place
        nearest to one of these has the label of its patch.
    origin : metres, world frame; step : metres.
    edge : median edge of the changed triangles, metres.
    """

    patches: tuple[tuple[Label, Label], ...]
    changed: tuple[LabelledPlaces, ...]
    unchanged: tuple[int, ...]
    origin: Place
    step: Step
    edge: Step


class PageLabels(Document, frozen=True, kw_only=True):
    """`page/labels.json`.

    Parameters
    ----------
    title : the name that people see.
    metric : whether lengths are metres.
    holds, routes : as in `holds.json` and `routes.json`.
    """

    title: str
    metric: bool
    holds: tuple[Hold, ...]
    routes: tuple[Route, ...]
    surface: SurfaceLabels
