"""`walltopo scan --profile`: a trace of stages, functions and memory; a clear word without it."""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import msgspec
import pytest

from walltopo.cli.profiling import trace_threads
from walltopo.core.errors import EnvironmentLacksError


def _slow_loop(count: int) -> int:
    return sum(k % 7 for k in range(count))


def test_a_trace_has_functions_of_all_threads_and_memory(tmp_path: Path) -> None:
    pytest.importorskip("viztracer", reason="the extra profile")
    file = tmp_path / "trace.json"
    with trace_threads(file) as tracer:
        with tracer.log_event("stage dense"):
            _slow_loop(300_000)
        other = threading.Thread(target=_slow_loop, args=(300_000,))
        other.start()
        other.join()
    events = msgspec.json.decode(file.read_bytes())["traceEvents"]
    names = [event["name"] for event in events]
    assert any(name.startswith("stage dense") for name in names)
    assert len({e["tid"] for e in events if e["name"].startswith("_slow_loop")}) == 2
    memory = [event["args"]["resident MiB"] for event in events if event["name"] == "memory"]
    assert memory
    assert min(memory) > 10


def test_a_trace_is_written_of_a_scan_that_fails(tmp_path: Path) -> None:
    pytest.importorskip("viztracer", reason="the extra profile")
    file = tmp_path / "trace.json"
    with pytest.raises(ValueError, match="bad"), trace_threads(file):
        raise ValueError("bad photo")
    assert file.is_file()


def test_without_the_extra_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "viztracer", None)
    with (
        pytest.raises(EnvironmentLacksError, match="viztracer"),
        trace_threads(tmp_path / "t.json"),
    ):
        pass


def test_no_file_no_trace() -> None:
    with trace_threads(None) as tracer:
        assert tracer is None
