"""Memory of this process: now, and its peak over a stretch (Linux; elsewhere over its life)."""

from __future__ import annotations

import resource
from pathlib import Path


def reset_peak() -> None:
    """Start a new stretch. Where the kernel offers no reset, peaks are since the start."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def peak_mb() -> float:
    """Peak resident memory since the last reset, MiB."""
    return _of_status("VmHWM:")


def resident_mb() -> float:
    """Resident memory now, MiB."""
    return _of_status("VmRSS:")


def _of_status(name: str) -> float:
    """A line of the kernel's account of this process, MiB; where there is none, the life's peak."""
    try:
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith(name):
                return int(line.split()[1]) / 1024
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
