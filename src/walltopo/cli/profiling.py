"""`walltopo scan --profile FILE`: trace a scan's time and memory for Perfetto."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

from walltopo.cli.scan_progress import ScanListener
from walltopo.core.errors import EnvironmentLacksError
from walltopo.core.memory import resident_mb
from walltopo.scans.manifest import StageRecord

# Minimum duration of a traced call, microseconds: a scan makes hundreds of millions of calls.
_SHORTEST_US = 1000.0
_ENTRIES = 1_000_000
_SAMPLE_S = 0.25


class ProfiledListener(ScanListener):
    """A `ScanListener` that also marks the stages in a trace, if it has a tracer."""

    tracer: Any = None
    _span: AbstractContextManager[Any] | None = None

    def stage_begins(self, stage: str) -> None:
        super().stage_begins(stage)
        if self.tracer is not None:
            self._span = self.tracer.log_event(f"stage {stage}")
            self._span.__enter__()

    def stage_ends(self, stage: str, record: StageRecord) -> None:
        if self._span is not None:
            self._span.__exit__(None, None, None)
            self._span = None
        super().stage_ends(stage, record)


@contextmanager
def trace_threads(file: Path | None) -> Iterator[Any]:
    """Trace all threads during the block and write the trace to `file`, even after an error.

    The trace has the calls of at least a millisecond, and a track of this process's resident
    memory. It shows the duration of child processes (COLMAP), but not their calls.

    Yields
    ------
    viztracer's tracer, or None without a file.

    Raises
    ------
    EnvironmentLacksError : the extra `profile` is not installed.
    """
    if file is None:
        yield None
        return
    try:
        from viztracer import VizTracer
    except ImportError as error:
        raise EnvironmentLacksError(
            "--profile needs viztracer, which is not installed",
            "Run: pip install 'walltopo[profile]'",
        ) from error
    tracer = VizTracer(
        tracer_entries=_ENTRIES, min_duration=_SHORTEST_US, output_file=str(file), verbose=0
    )
    ended = threading.Event()
    sampler = threading.Thread(target=_record_memory, args=(tracer, ended), daemon=True)
    tracer.start()
    sampler.start()
    try:
        yield tracer
    finally:
        ended.set()
        sampler.join()
        tracer.stop()
        tracer.save()


def _record_memory(tracer: Any, ended: threading.Event) -> None:
    """Record the memory periodically."""
    while True:
        tracer.add_counter("memory", {"resident MiB": resident_mb()})
        if ended.wait(_SAMPLE_S):
            return
