"""Announcements, as a feature of the platform."""

from __future__ import annotations

from walltopo_gym.announcements.service import drop_old_announcements
from walltopo_gym.events import RowsExpired
from walltopo_gym.feature import Feature

FEATURE = Feature("announcements", data_listeners={RowsExpired: (drop_old_announcements,)})
