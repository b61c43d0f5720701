"""Scores of found contacts of limbs against the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from walltopo_climb.beta.contacts import WALL
from walltopo_climb.beta.in_view import LIMBS
from walltopo_climb.beta.orders import order_difference

WITHIN_S = 0.5


class LimbOnHold(Protocol):
    """A contact: a limb's index, a hold's id, and its begin in seconds."""

    @property
    def limb(self) -> int: ...
    @property
    def hold(self) -> int: ...
    @property
    def begin(self) -> float: ...


@dataclass
class ContactCounts:
    """Numbers of contacts: right, found and true."""

    right: int = 0
    found: int = 0
    true: int = 0

    @property
    def precision(self) -> float:
        return self.right / max(self.found, 1)

    @property
    def recall(self) -> float:
        return self.right / max(self.true, 1)

    @property
    def f1(self) -> float:
        return 2 * self.right / max(self.found + self.true, 1)


def count_contacts(
    found: Sequence[LimbOnHold],
    true: Sequence[LimbOnHold],
    hands: ContactCounts,
    feet: ContactCounts,
) -> None:
    """Add to the counts of hands and feet.

    A found contact is right if the same limb takes the same hold within half a second; each true
    one counts once. Contacts with the bare wall are left out.
    """
    for limb in range(LIMBS):
        counts = hands if limb < LIMBS // 2 else feet
        own = [one for one in found if one.limb == limb and one.hold != WALL]
        open_ones = [one for one in true if one.limb == limb]
        counts.found += len(own)
        counts.true += len(open_ones)
        for one in sorted(own, key=lambda contact: contact.begin):
            fits = [
                other
                for other in open_ones
                if other.hold == one.hold and abs(other.begin - one.begin) <= WITHIN_S
            ]
            if fits:
                open_ones.remove(min(fits, key=lambda other: abs(other.begin - one.begin)))
                counts.right += 1


def order_distance(found: Sequence[LimbOnHold], true: Sequence[LimbOnHold]) -> float:
    """Return how much the hands' moves (limb and hold, in order of time) differ."""
    sequences = [
        [(one.limb, one.hold) for one in sorted(side, key=lambda one: one.begin) if one.limb < 2]
        for side in (found, true)
    ]
    return order_difference(*sequences)
