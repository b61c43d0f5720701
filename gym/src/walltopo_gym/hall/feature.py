"""The venue's screen and paper, as a feature of the platform."""

from __future__ import annotations

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.events import Admission
from walltopo_gym.feature import Feature
from walltopo_gym.hall.demo import show_board
from walltopo_gym.hall.screen import admit_screen

FEATURE = Feature(
    "hall", switch="hall", listeners={Admission: (admit_screen,), DemoFilled: (show_board,)}
)
