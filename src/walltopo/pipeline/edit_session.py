"""Open an edit session on a scan; rerun `edit` and `export` after each saved log."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

from walltopo.editing.log_file import EditLogFile
from walltopo.editing.session import EditLogStore, EditSession
from walltopo.editing.settings import EditSettings
from walltopo.pipeline.runner import refresh, stale_stages, stored_settings
from walltopo.pipeline.stages.edit import EDIT
from walltopo.pipeline.stages.export import EXPORT
from walltopo.pipeline.workplace import locked
from walltopo.scans.artifacts import Load
from walltopo.scans.folder import ScanFolder

STAGES_AFTER_LOG = (EDIT.name, EXPORT.name)


class _ScanStages:
    """The stages that depend on the edit log of a scan."""

    def __init__(self, folder: ScanFolder) -> None:
        self._folder = folder

    @property
    def settings(self) -> EditSettings:
        return stored_settings(self._folder).edit

    def is_stale(self) -> bool:
        return bool(stale_stages(self._folder, STAGES_AFTER_LOG))

    def hold(self) -> AbstractContextManager[None]:
        return locked(self._folder)

    def run(self, load: Load) -> None:
        refresh(self._folder, STAGES_AFTER_LOG, load)


def open_session(
    folder: ScanFolder,
    store: EditLogStore | None = None,
    rebuilt: Callable[[str], None] | None = None,
) -> EditSession:
    """Return an edit session on a finished scan.

    Parameters
    ----------
    store : keeps the log (default: the folder's `edits.json`).
    rebuilt : as in `EditSession`.
    """
    return EditSession(folder, store or EditLogFile(folder), _ScanStages(folder), rebuilt)
