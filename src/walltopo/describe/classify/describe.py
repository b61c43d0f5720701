"""What is known of each instance, put together: place, colour, type, role."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec.structs import replace

from walltopo.describe.classify.colour import Coloured
from walltopo.describe.classify.cutouts import best_views
from walltopo.describe.classify.geometry import Shape
from walltopo.describe.classify.light import TINT_RADIUS
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import Entry
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.describe.classify.types import Relief, shipped_model
from walltopo.scans.attributes import UNKNOWN, Hold, Role
from walltopo.scans.light import SceneLight


def _role(kind: str, colour: str, roles: Mapping[str, Role], downclimb: str) -> Role:
    if kind == "volume":
        return "volume"
    if downclimb and colour == downclimb:
        return "downclimb"
    return roles.get(colour, "hold")


def describe(
    kinds: Mapping[int, str],
    shapes: Mapping[int, Shape],
    colours: Mapping[int, Coloured],
    seen: Mapping[int, Sequence[HoldView]],
    photos: Sequence[str],
    palette: Sequence[Entry],
    settings: ClassifySettings,
) -> list[Hold]:
    """Put together what is known of each instance that has triangles, in the order of ids.

    An instance that no photo shows keeps the colour "unknown" and is marked for review.
    """
    roles = {entry.name: entry.role for entry in palette}
    holds: list[Hold] = []
    for number in sorted(shapes):
        shape, kind = shapes[number], kinds[number]
        colour = colours.get(number, Coloured(UNKNOWN, (128, 128, 128), 0.0))
        best = best_views(seen.get(number, ()), len(photos))
        volume = kind == "volume"
        x, y, z = (float(v) for v in shape.position)
        nx, ny, nz = (float(v) for v in shape.normal)
        holds.append(
            Hold(
                id=number,
                kind=kind,
                position=(x, y, z),
                normal=(nx, ny, nz),
                type="volume" if volume else UNKNOWN,
                type_confidence=1.0 if volume else 0.0,
                colour=colour.name,
                colour_rgb=colour.rgb,
                colour_confidence=colour.confidence,
                size=shape.size,
                area=shape.area,
                steepness_deg=shape.steepness_deg,
                photos=tuple(photos[view.photo] for view in best),
                role=_role(kind, colour.name, roles, settings.downclimb),
                review=colour.confidence < settings.review_below,
            )
        )
    return holds


def with_types(holds: Sequence[Hold], looks: Mapping[int, Relief]) -> list[Hold]:
    """Name the type of each hold by its relief; volumes keep theirs.

    The type stays "unknown" where there is no relief or the model is not sure
    (`hold_type.TypeModel`).
    """
    asked = [hold.id for hold in holds if hold.kind == "hold" and hold.id in looks]
    answers = shipped_model().names_of([looks[number] for number in asked])
    typed = []
    found = dict(zip(asked, answers, strict=True))
    for hold in holds:
        name, sure = found.get(hold.id, (UNKNOWN, 0.0))
        if name != UNKNOWN:
            hold = replace(hold, type=name, type_confidence=sure)
        typed.append(hold)
    return typed


def with_tints(holds: Sequence[Hold], light: SceneLight, unit: float) -> list[Hold]:
    """Note the tint of the wall around each hold, for `routes.link = "paint"`."""
    positions = np.array([hold.position for hold in holds]).reshape(-1, 3)
    tints = light.tint_at(positions, TINT_RADIUS * unit).tolist()
    return [
        replace(hold, wall_tint=(red, green, blue))
        for hold, (red, green, blue) in zip(holds, tints, strict=True)
    ]
