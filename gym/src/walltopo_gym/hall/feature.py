"""The venue's screen and paper, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.events import Admission
from walltopo_gym.feature import Feature
from walltopo_gym.hall.demo import show_board
from walltopo_gym.hall.screen import admit

if TYPE_CHECKING:
    from fastapi import APIRouter


def _routers() -> Sequence[APIRouter]:
    from walltopo_gym.hall.http import ROUTERS

    return ROUTERS


FEATURE = Feature(
    switch="hall", routers=_routers, listeners={Admission: (admit,), DemoFilled: (show_board,)}
)
