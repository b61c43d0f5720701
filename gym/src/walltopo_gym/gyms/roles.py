"""What somebody is in a gym. Each role may do what those below it may."""

from __future__ import annotations

from enum import StrEnum


class Role(StrEnum):
    """In rising order; `GUEST` is whoever does not belong to the gym."""

    GUEST = "guest"
    MEMBER = "member"
    JUDGE = "judge"
    SETTER = "setter"
    OWNER = "owner"

    def covers(self, other: Role) -> bool:
        """Whether this role may do what `other` may."""
        order = list(Role)
        return order.index(self) >= order.index(other)
