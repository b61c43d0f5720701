"""The scans that are opened in this process: few, since each keeps a wall in memory."""

from __future__ import annotations

import threading
from collections import OrderedDict
from pathlib import Path
from typing import Final
from uuid import UUID

from walltopo_gym.database.engine import Database
from walltopo_gym.editing.opened import Opened
from walltopo_gym.errors import TooManyError
from walltopo_gym.storage.files import FileStore

_SOON_S: Final = 60


class Desks:
    """Opens scans, and closes those that were not used for longest.

    Parameters
    ----------
    folder : of this process alone, for scan folders.
    most : scans opened at a time.
    """

    def __init__(self, folder: Path, most: int, database: Database, store: FileStore) -> None:
        self._folder, self._most = folder, most
        self._database, self._store = database, store
        self._opening = threading.Lock()
        self._opened: OrderedDict[UUID, Opened] = OrderedDict()

    def of(self, scan: UUID) -> Opened:
        """The scan, opened; the first time takes as long as reading it.

        Raises
        ------
        TooManyError : others are being edited, and none can be closed now.
        """
        with self._opening:
            found = self._opened.get(scan)
            if found is None:
                self._make_room()
                folder = self._folder / str(scan)
                found = Opened(scan, folder, self._database, self._store)
                self._opened[scan] = found
            self._opened.move_to_end(scan)
            return found

    def close(self) -> None:
        """Close all."""
        with self._opening:
            while self._opened:
                self._opened.popitem()[1].close()

    def _make_room(self) -> None:
        while len(self._opened) >= self._most:
            idle = next((one for one in self._opened.values() if one.is_idle), None)
            if idle is None:
                raise TooManyError("other walls are being edited", _SOON_S)
            self._opened.pop(idle.scan).close()
