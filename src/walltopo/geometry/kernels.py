"""Compile loops with numba and run them on all cores.

A compiled kernel is cached on disk, so only the first scan on a machine waits for the compiler.
`parallel=True` is not used, because it doubles or triples the compile time: a kernel takes a range,
and `in_ranges` calls it from threads. Division by zero gives inf or nan, as in NumPy.

Kernels are compiled for a common processor type instead of the host's, so that kernels compiled on
another machine can run here (a wheel carries them, see `tools.compiled_wheel`).

Importing this module imports numba (about half a second).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

from llvmlite.binding import get_host_cpu_features
from numba import config, njit

from walltopo.core.parallel import available_cores

# Intel's processors since about 2013 and AMD's since about 2015, and the flags that identify them.
PROCESSOR = "x86-64-v3"
_REQUIRED_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")

# An explicit NUMBA_CPU_NAME wins over our default.
if config.CPU_NAME is None and config.CPU_FEATURES is None:
    _features = get_host_cpu_features()
    if all(_features.get(name) for name in _REQUIRED_FEATURES):
        config.CPU_NAME, config.CPU_FEATURES = PROCESSOR, ""

kernel = njit(nogil=True, error_model="numpy", cache=True)

# Ranges per thread; several balance the load if ranges take different times.
_PARTS = 4


def in_ranges(work: Callable[..., None], count: int, *arguments: Any, min_size: int = 1) -> None:
    """Call `work(begin, end, *arguments)` on all cores, for ranges that partition 0 to `count`.

    Parameters
    ----------
    work : kernel whose ranges write to disjoint memory, so that their order has no effect.
    arguments : further arguments of `work`.
    min_size : minimum size of a range.
    """
    parts = min(available_cores() * _PARTS, count // max(min_size, 1))
    if available_cores() == 1 or parts <= 1:
        work(0, count, *arguments)
        return
    borders = [count * part // parts for part in range(parts + 1)]
    with ThreadPoolExecutor(min(available_cores(), parts)) as pool:
        calls = [pool.submit(work, begin, end, *arguments) for begin, end in pairwise(borders)]
        for call in calls:
            call.result()
