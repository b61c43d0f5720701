"""Roles in a gym. Each role has the rights of those below it."""

from __future__ import annotations

from enum import StrEnum


class Role(StrEnum):
    """Roles in rising order; `GUEST` is everybody outside the gym."""

    GUEST = "guest"
    MEMBER = "member"
    JUDGE = "judge"
    SETTER = "setter"
    OWNER = "owner"

    def covers(self, other: Role) -> bool:
        """Return whether this role has the rights of `other`."""
        order = list(Role)
        return order.index(self) >= order.index(other)
