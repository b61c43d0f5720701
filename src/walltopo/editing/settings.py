"""Settings of the `edit` stage, and what it reads and makes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class EditSettings:
    """How corrections are carried out (section `edit`)."""

    photos: Annotated[
        int,
        about("Photos that an added hold is read in: those that see it best", low=1, high=50),
    ] = 5

    def __post_init__(self) -> None:
        check_settings(self, "edit")
