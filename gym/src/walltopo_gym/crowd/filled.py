"""The event that the demo gym has its people, so that each feature adds what shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from walltopo_gym.events import Event
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.version_holds import VersionHolds
from walltopo_gym.walls.models import Wall


@dataclass(frozen=True)
class DemoFilled(Event):
    """The demo gym has its people and their ascents. Published at each start of the
    demo: listeners add nothing twice.

    Parameters
    ----------
    setter : the setter's account; routes : current ones, graded by Font, in order of `set_on`.
    versions : holds of the published version of each of the walls; at : now.
    """

    gym: Gym
    setter: UUID
    routes: Sequence[Route]
    walls: Sequence[Wall]
    versions: Mapping[UUID, VersionHolds]
    at: datetime
