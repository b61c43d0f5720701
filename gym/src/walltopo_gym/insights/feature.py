"""Insights for setters, as a feature of the platform."""

from __future__ import annotations

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.feature import Feature
from walltopo_gym.insights.demo import fill_aims

FEATURE = Feature("insights", listeners={DemoFilled: (fill_aims,)}, switch="insights")
