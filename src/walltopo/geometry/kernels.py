"""Kernels: loops that numba compiles on their first call, and their way onto all cores.

A compiled kernel is kept on disk: only the first scan on a machine waits for the compiler. So that
it waits little, nothing here is compiled with `parallel=True`, which takes numba two to three times
as long: a kernel takes a range, and `in_ranges` calls it from threads. Division by zero gives inf
or nan, as in NumPy.

Kernels are compiled for a common kind of processor and not for this one: so those that another
machine compiled (a wheel carries them, see `walltopo_lab.compiled_wheel`) run here, too.

Importing this module imports numba (about half a second).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

from llvmlite.binding import get_host_cpu_features
from numba import config, njit

from walltopo.core.parallel import cores

# Intel's and AMD's processors from about 2013 and 2015 on, and what tells them.
PROCESSOR = "x86-64-v3"
_HAS = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")

# Who says for what numba compiles has decided.
if config.CPU_NAME is None and config.CPU_FEATURES is None:
    _features = get_host_cpu_features()
    if all(_features.get(name) for name in _HAS):
        config.CPU_NAME, config.CPU_FEATURES = PROCESSOR, ""

kernel = njit(nogil=True, error_model="numpy", cache=True)

# Ranges a thread: the last one is then short, where some take longer than others.
_PARTS = 4


def in_ranges(work: Callable[..., None], count: int, *given: Any, least: int = 1) -> None:
    """Call `work(begin, end, *given)` for ranges that together are 0 to `count`, on all cores.

    Parameters
    ----------
    work : a kernel whose ranges write to places of their own: their order decides nothing.
    least : fewer than this are not worth a range of their own.
    """
    parts = min(cores() * _PARTS, count // max(least, 1))
    if cores() == 1 or parts <= 1:
        work(0, count, *given)
        return
    borders = [count * part // parts for part in range(parts + 1)]
    with ThreadPoolExecutor(min(cores(), parts)) as pool:
        calls = [pool.submit(work, begin, end, *given) for begin, end in pairwise(borders)]
        for call in calls:
            call.result()
