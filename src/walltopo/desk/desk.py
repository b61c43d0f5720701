"""The desk itself: what the server asks of a scan that is edited."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, WalltopoError
from walltopo.desk.crops import crops_of
from walltopo.desk.log_file import log_version, read_log, save_log
from walltopo.desk.results import result_of, shown_labels
from walltopo.desk.shelf import Shelf
from walltopo.edit.board import Scanned
from walltopo.edit.contract import Reads
from walltopo.edit.replay import Outcome, replay
from walltopo.edit.result import Result
from walltopo.export.server.desk import Crop, State, problem_key
from walltopo.pipeline.runner import kept_settings, refresh, stale_stages
from walltopo.pipeline.workplace import held
from walltopo.scans.edits import EditLog, Place
from walltopo.scans.folder import ScanFolder
from walltopo.setting.ease import Way
from walltopo.setting.rows import Proposals, Tweaks
from walltopo.setting.wall import SetWall
from walltopo.setting.wish import Wish

__all__ = ["FOLLOWING", "Desk"]

FOLLOWING = ("edit", "export")  # what follows from the log


class Desk:
    """A scan on which edits are tried and saved; what follows from a save is made in a thread.

    Trying and carrying out are one code: `walltopo.edit.replay`, on the files of the scan, which
    are read once and kept while they stay as they are.

    Parameters
    ----------
    made : called in that thread with the version of the log that the files show now; what it
        raises is the state's problem.
    """

    def __init__(self, folder: ScanFolder, made: Callable[[str], None] | None = None) -> None:
        self.folder = folder
        self._made = made
        self.shelf = Shelf()
        self._replaying = threading.Lock()
        self._searching = threading.Lock()  # it takes a processor for seconds
        self._saving = threading.Lock()  # also: no run sweeps the folder while a file is written
        self._scanned: tuple[Reads, Scanned] | None = None
        self._touched: NDArray[np.bool_] | None = None
        self._worker: threading.Thread | None = None
        self._turn = threading.Lock()
        self._wanted = self._running = False
        self._done = "" if stale_stages(folder, FOLLOWING) else log_version(folder)
        self._problem = self._problem_key = ""

    def read(self) -> tuple[EditLog, str]:
        """The log and its version."""
        return read_log(self.folder)

    def tried(self, log: EditLog) -> Result:
        """What a log makes of the scan; writes nothing."""
        with self._replaying:
            scanned = self._load()
            outcome = replay(scanned, log.edits)
            return result_of(scanned, outcome, self._touch(scanned, outcome))

    def saved(self, log: EditLog, version: str) -> tuple[Result, str]:
        """Save a log, and begin what follows from it; its result, and its version."""
        result = self.tried(log)  # before it is saved: one that cannot be replayed is refused
        now = self.write(log, version)
        self.follow()
        return result, now

    def write(self, log: EditLog, version: str | None = None) -> str:
        """Save a log and no more; its version.

        Parameters
        ----------
        version : that it was made on; None: whatever there is gives way.
        """
        with self._saving:
            return save_log(self.folder, log, version or log_version(self.folder))

    def proposed(self, log: EditLog, wish: Wish) -> Proposals:
        """Problems for the wall as a log makes it; writes nothing."""
        wall = self._wall(log)
        with self._searching:
            return wall.propose(wish)

    def eased(self, log: EditLog, route: int, way: Way) -> Tweaks:
        """What makes a route of the wall, as a log makes it, one grade easier or harder."""
        wall = self._wall(log)
        with self._searching:
            return wall.ease(route, way)

    def state(self) -> State:
        """Whether the files of the scan show the log that is saved."""
        stale = self._done != log_version(self.folder)
        return State(stale, self._running, self._done, self._problem, self._problem_key)

    def crops(self, at: Place) -> list[Crop]:
        """A place in the photos that show it best."""
        with self._replaying:
            return crops_of(self._load(), at)

    def follow(self) -> None:
        """Bring the stages after the log up to date, in a thread; after the one that is at it."""
        with self._turn:
            self._wanted = True
            if not self._running:
                self._running = True
                self._worker = threading.Thread(target=self._follow, name="edits", daemon=True)
                self._worker.start()

    def close(self) -> None:
        """Wait until what was begun is written."""
        if self._worker is not None:
            self._worker.join()

    def _follow(self) -> None:
        while True:
            with self._turn:
                if not self._wanted:
                    self._running = False
                    return
                self._wanted = False
            version = log_version(self.folder)
            self._problem = self._problem_key = ""
            try:
                with ExitStack() as stack:
                    with self._saving:
                        stack.enter_context(held(self.folder))
                    refresh(self.folder, FOLLOWING, self.shelf.load)
                    if self._made is not None:
                        self._made(version)
                self._done = version
            except WalltopoError as error:
                self._problem, self._problem_key = str(error), problem_key(error)
            except Exception as error:  # the page must hear of it, and the server go on
                self._problem = f"{type(error).__name__}: {error}"

    def _wall(self, log: EditLog) -> SetWall:
        with self._replaying:
            scanned = self._load()
            outcome = replay(scanned, log.edits)
            floor_known = self.shelf.load(self.folder, "scale").floor_known
        return SetWall.of(outcome.holds.holds, outcome.routes.routes, scanned.unit, floor_known)

    def _load(self) -> Scanned:
        """What the scan found; built anew where a file of it changed."""
        given = {field.name: self.shelf.load(self.folder, field.name) for field in fields(Reads)}
        reads = Reads(**given)
        kept = self._scanned
        same = kept is not None and all(
            getattr(kept[0], name) is value
            for name, value in given.items()
            if name not in ("edits", "hold_edits", "route_edits")
        )
        if kept is None or not same:
            scanned = Scanned.of(reads, kept_settings(self.folder).edit)
            self._scanned = kept = (reads, scanned)
            self._touched = None
        return kept[1]

    def _touch(self, scanned: Scanned, outcome: Outcome) -> NDArray[np.bool_]:
        """(F,) triangles that any log of this desk changed, or the one that pages were made with.

        A page shows the labels that were in the files when it was loaded, whichever these were.
        """
        before = shown_labels(scanned.labels, (hold.id for hold in scanned.found.instances))
        if self._touched is None:
            self._touched = np.zeros(len(before), dtype=bool)
            with suppress(InputError):
                self._touched |= before != self._written(scanned)
        self._touched |= before != shown_labels(
            outcome.labels, (row.id for row in outcome.holds.holds)
        )
        return self._touched

    def _written(self, scanned: Scanned) -> NDArray[np.int32]:
        """The labels that the files of the scan have."""
        change = self.shelf.load(self.folder, "relabelled")
        labels = scanned.labels if change is None else change.on(scanned.labels)
        rows = self.shelf.load(self.folder, "holds").holds
        return shown_labels(labels, (row.id for row in rows))
