"""Insights for setters, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.feature import Feature
from walltopo_gym.insights.demo import fill_aims

if TYPE_CHECKING:
    from fastapi import APIRouter


def _routers() -> Sequence[APIRouter]:
    from walltopo_gym.insights.http import ROUTERS

    return ROUTERS


FEATURE = Feature(listeners={DemoFilled: (fill_aims,)}, switch="insights", routers=_routers)
