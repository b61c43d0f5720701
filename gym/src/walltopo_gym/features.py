"""The list of the platform's optional features, and who listens to what.

Deleting a feature's folder, its name here and its pages leaves a platform that works.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from importlib import import_module
from typing import Final

from walltopo_gym.climbing.by_id import climbed_routes, routes_by_id
from walltopo_gym.climbing.counting import queue_recount
from walltopo_gym.climbing.logged import logged_routes
from walltopo_gym.climbing.people import took_part
from walltopo_gym.database.engine import Database, Listener, Listeners
from walltopo_gym.events import (
    ClimbedBy,
    ClimbsById,
    DaysChanged,
    HoldHistoryOf,
    LoggedClimbs,
    TookPart,
)
from walltopo_gym.feature import Feature
from walltopo_gym.publishing.hold_history import add_versions
from walltopo_gym.settings import GymSettings, Switch
from walltopo_gym.storage.switch_note import check_whole

NAMES: Final = (
    "announcements",
    "apps",
    "assistants",
    "climbing_log",
    "clips",
    "competitions",
    "grading",
    "hall",
    "hold_changes",
    "hold_reports",
    "insights",
    "inspections",
    "lists",
    "notifications",
    "problems",
    "reset_plans",
    "webhooks",
)
_CORE: Final[Listeners] = {
    ClimbedBy: (climbed_routes,),
    ClimbsById: (routes_by_id,),
    DaysChanged: (queue_recount,),
    HoldHistoryOf: (add_versions,),
    LoggedClimbs: (logged_routes,),
    TookPart: (took_part,),
}


def _load_feature(name: str) -> Feature:
    found = import_module(f"walltopo_gym.{name}.feature").FEATURE
    assert isinstance(found, Feature)
    return found


FEATURES: Final[tuple[Feature, ...]] = tuple(map(_load_feature, NAMES))


def features_on(settings: GymSettings) -> list[Feature]:
    """Return the features that a server has on."""
    return _enabled_features(settings.features)


def _enabled_features(switches: Collection[Switch]) -> list[Feature]:
    return [one for one in FEATURES if one.switch is None or one.switch in switches]


def listeners_of(switches: Collection[Switch]) -> Listeners:
    """Return all listeners on a server with these switches."""
    found: dict[type, list[Listener]] = defaultdict(list)
    tables = [_CORE, *(one.data_listeners for one in FEATURES)]
    tables += [one.listeners for one in _enabled_features(switches)]
    for table in tables:
        for kind, listeners in table.items():
            found[kind] += listeners
    return found


def open_database(settings: GymSettings) -> Database:
    """Return the platform's database, with all listeners.

    Raises
    ------
    EnvironmentLacksError : as in `check_whole`.
    """
    check_whole(settings.data)
    return Database(settings.database_url, listeners_of(settings.features))
