"""A gym some weeks later: holds that turned, shifted or are gone, and everything else unchanged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import read_json
from walltopo_lab.synth.bodies import Facet, GymInstance, Placement

Floats = NDArray[np.float64]

# Shares of the holds. A real wall has a loose hold or two; figures need more of them.
_TURNED: Final = 0.2
_SHIFTED: Final = 0.1
_GONE: Final = 0.05
_TURN_DEG: Final = (5.0, 90.0)
_SHIFT_M: Final = (0.01, 0.05)
_GAP_M: Final = 0.005  # between a shifted hold and its neighbours
_ATTEMPTS: Final = 20  # directions that are tried for a shift


@dataclass(frozen=True)
class Wear:
    """The holds of a gym that changed by themselves.

    Parameters
    ----------
    turned : id to degrees, counter-clockwise seen from the climber.
    shifted : id to metres.
    gone : ids.
    """

    turned: dict[int, float]
    shifted: dict[int, float]
    gone: tuple[int, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the entry in `scene.json`."""
        return {
            "turned_deg": {str(key): round(value, 2) for key, value in self.turned.items()},
            "shifted_m": {str(key): round(value, 4) for key, value in self.shifted.items()},
            "gone": list(self.gone),
        }


def read_wear(folder: Path) -> Wear:
    """Return the wear of a gym of `walltopo synth --wear-of`.

    Raises
    ------
    InputError : the folder is no such gym.
    """
    path = folder / "truth" / "scene.json"
    record = read_json(path).get("wear") if path.is_file() else None
    if record is None:
        raise InputError(f"{folder}: not a gym of `walltopo synth --wear-of`")
    turned, shifted = (
        {int(key): float(value) for key, value in record[name].items()}
        for name in ("turned_deg", "shifted_m")
    )
    return Wear(turned, shifted, tuple(record["gone"]))


def wear_holds(
    holds: Sequence[GymInstance], facets: Sequence[Facet], rng: np.random.Generator
) -> tuple[list[GymInstance], Wear]:
    """Return the holds some weeks later.

    A hold turns about its bolt. One that is to shift, but has no room for it, stays.

    Parameters
    ----------
    holds : of the gym, with bodies. facets : what they are bolted to.
    """
    worn, gone = list[GymInstance](), list[int]()
    turned, shifted = dict[int, float](), dict[int, float]()
    chances = rng.random(len(holds))
    for hold, chance in zip(holds, chances.tolist(), strict=True):
        if chance < _GONE:
            gone.append(hold.id)
        elif chance < _GONE + _TURNED:
            angle = float(rng.uniform(*_TURN_DEG) * rng.choice((-1, 1)))
            worn.append(_turn_hold(hold, np.radians(angle)))
            turned[hold.id] = angle
        elif chance < _GONE + _TURNED + _SHIFTED:
            length = float(rng.uniform(*_SHIFT_M))
            moved = _shift_hold(hold, length, holds, facets, rng)
            worn.append(moved or hold)
            if moved is not None:
                shifted[hold.id] = length
        else:
            worn.append(hold)
    return worn, Wear(turned, shifted, tuple(gone))


def _turn_hold(hold: GymInstance, angle: float) -> GymInstance:
    """Return the hold turned about its bolt; angle in radians."""
    assert hold.placement is not None
    cos, sin = np.cos(angle), np.sin(angle)
    about_bolt = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return replace(
        hold, placement=Placement(hold.placement.rotation @ about_bolt, hold.placement.origin)
    )


def _shift_hold(
    hold: GymInstance,
    length: float,
    others: Sequence[GymInstance],
    facets: Sequence[Facet],
    rng: np.random.Generator,
) -> GymInstance | None:
    """Return the hold shifted along its facet, None if there is no room; length in metres."""
    assert hold.placement is not None
    facet = next((one for one in facets if one.carries(hold.position)), None)
    if facet is None:
        return None
    u, v, _ = facet.frame
    for angle in rng.uniform(0.0, 2 * np.pi, _ATTEMPTS).tolist():
        position = hold.position + length * (np.cos(angle) * u + np.sin(angle) * v)
        if facet.carries(position) and _is_free(position, hold, others):
            placement = Placement(hold.placement.rotation, position)
            return replace(hold, position=position, placement=placement)
    return None


def _is_free(position: Floats, hold: GymInstance, others: Sequence[GymInstance]) -> bool:
    assert hold.body is not None
    for other in others:
        if other.id == hold.id or other.body is None:
            continue
        room = other.body.radius + hold.body.radius + _GAP_M
        before = float(np.linalg.norm(other.position - hold.position))
        if float(np.linalg.norm(other.position - position)) < min(room, before):
            return False
    return True
