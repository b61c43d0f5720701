"""Peak memory of this process over a stretch of time (Linux; elsewhere over its life)."""

from __future__ import annotations

import resource
from pathlib import Path

__all__ = ["peak_mb", "reset_peak"]


def reset_peak() -> None:
    """Start a new stretch. Where the kernel offers no reset, peaks are since the start."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def peak_mb() -> float:
    """Peak resident memory since the last reset, MiB."""
    try:
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
