"""Measure the memory of this machine and of this process."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

import psutil

_MIB = 2**20


def total_memory() -> int:
    """Return the bytes of memory of this machine."""
    return int(psutil.virtual_memory().total)


def free_memory() -> int:
    """Return the bytes of memory that the system can still provide."""
    return int(psutil.virtual_memory().available)


def resident_mb() -> float:
    """Return the present resident memory of this process, MiB."""
    return float(psutil.Process().memory_info().rss) / _MIB


def peak_mb() -> float:
    """Return the peak resident memory of this process, MiB.

    On Linux it counts from the last `reset_peak`, elsewhere from the start of the process.
    """
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) / 1024
    except (OSError, StopIteration):
        return _peak_since_start()


def _peak_since_start() -> float:
    if sys.platform != "win32":
        with suppress(ImportError):  # some builds of Python lack it
            import resource

            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            return peak / (_MIB if sys.platform == "darwin" else 1024)
    counted = psutil.Process().memory_info()
    return float(getattr(counted, "peak_wset", counted.rss)) / _MIB


def reset_peak() -> None:
    """Reset the peak memory; without kernel support, peaks count from the process's start."""
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:
        return
