"""Calls at the same moment, each in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from typing import TypeVar

_Result = TypeVar("_Result")


def at_once(*calls: Callable[[], _Result]) -> list[_Result]:
    """Return the results of calls that begin at the same moment.

    An error of a call is raised here, because an error in a bare thread fails no test.
    """
    start = Barrier(len(calls))

    def run(call: Callable[[], _Result]) -> _Result:
        start.wait(600)
        return call()

    with ThreadPoolExecutor(len(calls)) as pool:
        return list(pool.map(run, calls))
