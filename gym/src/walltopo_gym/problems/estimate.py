"""Estimate a problem by the movement model: a range of grades, and the heights that reach it."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Final, TypeVar

import msgspec
from msgspec.structs import replace

from walltopo.core.children import Child, child_process, python_module
from walltopo.scans.moves import ClimberRow
from walltopo.scans.routes import Route
from walltopo_climb.problems.openings import Opening
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import RequestError, UnavailableError
from walltopo_gym.problems.estimate_worker import EstimateRequest, ProblemEstimate
from walltopo_gym.problems.service import Use, UsedHold
from walltopo_gym.publishing.version_holds import VersionHolds

_LIMIT_S: Final = 5.0  # of one estimate; an ordinary problem takes a tenth of a second
_BEGIN_S: Final = 180.0  # of a new process, which may have to compile


Answer = TypeVar("Answer")


class Estimator:
    """Estimates problems one after the other, in a process that is killed if one takes too long."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process = ExitStack()
        self._child: Child | None = None
        self._is_closed = False

    def estimate(self, used: Sequence[UsedHold], version: VersionHolds) -> ProblemEstimate:
        """Return what the model says of a problem on a version of its wall.

        Raises
        ------
        RequestError : it takes too long; UnavailableError : the process does not start.
        """
        return self._ask(_request(used, version), ProblemEstimate)

    def moves(self, used: Sequence[UsedHold], version: VersionHolds) -> tuple[ClimberRow, ...]:
        """Return the moves of several bodies; errors as for `estimate`."""
        wanted = replace(_request(used, version), task="moves")
        return self._ask(wanted, tuple[ClimberRow, ...])

    def openings(self, used: Sequence[UsedHold], version: VersionHolds) -> tuple[Opening, ...]:
        """Return the holds that open a problem to shorter climbers; errors as for `estimate`."""
        wanted = replace(_request(used, version), task="openings")
        return self._ask(wanted, tuple[Opening, ...])

    def _ask(self, request: EstimateRequest, kind: type[Answer]) -> Answer:
        check_unlocked("a problem is estimated")
        message = msgspec.json.encode(request) + b"\n"
        with self._lock:
            line, is_late = _exchange_message(self._running(), message, _LIMIT_S)
            if not line and not is_late:  # the process had died: a new one answers
                line, is_late = _exchange_message(self._running(), message, _LIMIT_S)
        if not line:
            raise RequestError("estimate-too-long", "estimate-fewer-holds")
        return msgspec.json.decode(line, type=kind)

    def close(self) -> None:
        """End the process for good."""
        with self._lock:
            self._process.close()
            self._child, self._is_closed = None, True

    def _running(self) -> Child:
        if self._is_closed:
            raise UnavailableError("estimate-no-process")
        if self._child is None or not self._child.is_running:
            self._process.close()
            command = python_module("walltopo_gym.problems.estimate_worker")
            # Its stderr goes into the operator's log.
            self._child = self._process.enter_context(child_process(command, errors=None))
            if not _exchange_message(self._child, b"", _BEGIN_S)[0]:
                raise UnavailableError("estimate-no-process")
        return self._child


def _exchange_message(child: Child, message: bytes, limit_s: float) -> tuple[bytes, bool]:
    """Send a message; return the next whole line, empty if there is none, and whether it was late.

    A process that is late is killed.
    """
    late = threading.Event()

    def end() -> None:
        late.set()
        child.kill()

    timer = threading.Timer(limit_s, end)
    timer.start()
    try:
        child.send(message)
        line = child.output.readline()
    finally:
        timer.cancel()
        timer.join()
    if not line.endswith(b"\n"):
        child.kill()
        return b"", late.is_set()
    return line, late.is_set()


def _request(used: Sequence[UsedHold], version: VersionHolds) -> EstimateRequest:
    return EstimateRequest(_route(used, version), [*version.by_id.values()], version.unit)


def _route(used: Sequence[UsedHold], version: VersionHolds) -> Route:
    def of(use: Use) -> tuple[int, ...]:
        return tuple(each.hold for each in used if each.use == use)

    upwards = sorted((each.hold for each in used), key=lambda hold: version.by_id[hold].position[2])
    return Route(
        id=1, holds=tuple(upwards), start=of(Use.START), top=of(Use.TOP), footholds=of(Use.FOOT)
    )
