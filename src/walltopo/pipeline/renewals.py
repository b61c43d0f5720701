"""Renew files of other packages before a stage reads them, such as `moves.json`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from walltopo.core import Progress, WalltopoError
from walltopo.core.plugins import PluginGroup
from walltopo.pipeline.plan import Step
from walltopo.scans.folder import ScanFolder

Renew = Callable[[ScanFolder], None]

# An entry point has the name of a file in the scan folder. It is called while the folder's lock is
# held and the file exists, and writes the file anew if the holds or routes it was made for changed.
RENEWALS: Final[PluginGroup[Renew]] = PluginGroup(
    "walltopo.renewals", "renewal", "not a file that an installed package renews", "or none."
)


def renew_inputs(step: Step, progress: Progress) -> None:
    """Renew the files of other packages that a stage reads; a failure is noted and stops nothing.

    A file that does not exist was never requested and is not made.
    """
    for item in step.stage.reads:
        if item.made_by or not item.in_folder(step.folder).exists():
            continue
        if item.path not in RENEWALS.names():
            continue
        try:
            RENEWALS.load(item.path)(step.folder)
        except WalltopoError as error:
            progress.note(f"{item.path} is not renewed: {error}")
