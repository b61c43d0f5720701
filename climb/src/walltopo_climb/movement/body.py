"""A climber's body as far as reach goes: segments by height and arm span."""

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
    """A climber.

    Parameters
    ----------
    height : metres. reach : arm span from fingertip to fingertip, metres; 0: as the height.

    Raises
    ------
    InputError : no such person.
    """

    height: float = 1.75
    reach: float = 0.0

    def __post_init__(self) -> None:
        if not 0.9 <= self.height <= 2.3:
            raise InputError(f"a height of {self.height:g} m", "Give it in metres, 0.9 to 2.3.")
        if self.reach and not 0.8 <= self.reach / self.height <= 1.2:
            raise InputError(
                f"an arm span of {self.reach:g} m at {self.height:g} m",
                "It is within a fifth of the height.",
            )

    @property
    def span(self) -> float:
        return self.reach or self.height

    @property
    def leg(self) -> float:
        """Hip to sole, straight, on the toes of one foot."""
        return _HIP * self.height

    @property
    def arm(self) -> float:
        """Shoulder to what the fingers hold."""
        return (_ARM - _HOOKED) * self.height + (self.span - self.height) / 2

    @property
    def torso(self) -> float:
        """Hip to shoulder."""
        return (_SHOULDER - _HIP) * self.height

    @property
    def shoulders(self) -> float:
        """From one shoulder to the other."""
        return _SHOULDERS * self.height


CHILD = Body(1.30)  # a child of about eight years
SHORT = Body(1.55)
ADULT = Body(1.75)  # whom the grades are learnt with
TALL = Body(1.90)
BODIES = {"child": CHILD, "short": SHORT, "adult": ADULT, "tall": TALL}
