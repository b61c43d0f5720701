"""A climber's body for reach: lengths of segments by height and arm span."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import InputError

# Shares of the height: Drillis & Contini (1966), as in Winter, "Biomechanics and Motor Control of
# Human Movement", fig. 4.1.
_HIP = 0.530  # floor to hip
_SHOULDER = 0.818  # floor to shoulder
_ARM = 0.440  # upper arm, forearm and hand
_SHOULDERS = 0.259  # from one shoulder to the other
# Fingers hook over a hold: the last two joints do not lengthen the arm.
_HOOKED = 0.025


@dataclass(frozen=True)
class Body:
    """The height and arm span of a climber.

    Parameters
    ----------
    height : metres. reach : arm span from fingertip to fingertip, metres; 0: as the height.

    Raises
    ------
    InputError : height or arm span is out of range.
    """

    height: float = 1.75
    reach: float = 0.0

    def __post_init__(self) -> None:
        if not 0.9 <= self.height <= 2.3:
            raise InputError(f"a height of {self.height:g} m", "Expected 0.9 to 2.3 metres.")
        if self.reach and not 0.8 <= self.reach / self.height <= 1.2:
            raise InputError(
                f"an arm span of {self.reach:g} m at {self.height:g} m",
                "Expected an arm span within a fifth of the height.",
            )

    @property
    def span(self) -> float:
        return self.reach or self.height

    @property
    def leg(self) -> float:
        """Return the length from hip to sole, straight, on the toes of one foot."""
        return _HIP * self.height

    @property
    def arm(self) -> float:
        """Return the length from shoulder to the contact of the fingers."""
        return (_ARM - _HOOKED) * self.height + (self.span - self.height) / 2

    @property
    def torso(self) -> float:
        """Return the length from hip to shoulder."""
        return (_SHOULDER - _HIP) * self.height

    @property
    def shoulders(self) -> float:
        """Return the distance between the shoulders."""
        return _SHOULDERS * self.height


CHILD = Body(1.30)  # a child of about eight years
SHORT = Body(1.55)
ADULT = Body(1.75)  # the body with which the grade model is trained
TALL = Body(1.90)
BODIES = {"child": CHILD, "short": SHORT, "adult": ADULT, "tall": TALL}
