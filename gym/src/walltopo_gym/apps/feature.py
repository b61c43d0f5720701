"""Apps of others, as a feature of the platform."""

from __future__ import annotations

from walltopo_gym.apps.registry import drop_expired, own_tables
from walltopo_gym.events import OwnTables, RowsExpired
from walltopo_gym.feature import Feature

FEATURE = Feature("apps", data_listeners={OwnTables: (own_tables,), RowsExpired: (drop_expired,)})
