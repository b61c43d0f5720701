"""Settings of the stage `edit`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class EditSettings:
    """Settings of the replay of corrections (section `edit`)."""

    # fmt: off
    photos: Annotated[int, about("Number of photos that an added hold is measured in", low=1, high=50, expert=True)] = 5
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "edit")
