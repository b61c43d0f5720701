"""The note of a replacement of a gym's data that has begun and not ended.

While it is there, some of the data folder's parts are the former ones and some the new ones.
Nothing may open the database: it would make an empty one in the place of a moved one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from walltopo.core import EnvironmentLacksError

NOTE: Final = "switch.json"


def check_whole(data: Path) -> None:
    """Check that no replacement of a data folder is half done.

    Raises
    ------
    EnvironmentLacksError : one is.
    """
    if (data / NOTE).exists():
        raise EnvironmentLacksError(
            f"{data}: its data are half replaced by a backup",
            "`walltopo gym doctor` goes on with it.",
        )
