"""Grade ranges as the API has them."""

from __future__ import annotations

from pydantic import BaseModel

from walltopo_climb.grades.font import FONT, V_OF
from walltopo_climb.grades.model import Range


class GradeBounds(BaseModel):
    """The easiest and the hardest grade of a range, inclusive, on two scales."""

    low: str
    high: str
    low_v: str
    high_v: str

    @classmethod
    def of(cls, found: Range) -> GradeBounds:
        """Return the bounds of a range of the model."""
        low, high = found.low, found.high
        return cls(low=FONT[low], high=FONT[high], low_v=f"V{V_OF[low]}", high_v=f"V{V_OF[high]}")
