"""Decode photos and videos: `python -m walltopo.reconstruct.ingest.decode_worker`.

Decoders are C libraries fed with files from anywhere. Here one of them may crash, or ask for more
memory than ingest may take, and costs no more than the file that it was given.
"""

from __future__ import annotations

import os
import resource
import sys
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

import msgspec

from walltopo.core import EnvironmentLacksError
from walltopo.core.children import end_with_parent
from walltopo.reconstruct.ingest.decode_job import Answer, Begun, Broken, Done, Job
from walltopo.reconstruct.ingest.memory_gate import BUDGET, Room
from walltopo.reconstruct.ingest.store import store_file

# Stacks of decoders' threads, which count though hardly any of them is used.
_BESIDE: Final = 160 * 2**20


def main() -> None:
    """Read one job from stdin, answer on stdout; end when stdin ends, for then nobody listens."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # libraries that print do not get between the answers
    job = msgspec.json.decode(sys.stdin.buffer.readline(), type=Job)
    end_with_parent()
    lock = threading.Lock()

    def answer(value: Answer) -> None:
        with lock:
            answers.write(msgspec.json.encode(value) + b"\n")

    _load_libraries()
    _limit_memory()
    room = Room()
    with ThreadPoolExecutor(max_workers=job.threads) as pool:
        for number, path in job.files.items():
            pool.submit(_run, number, Path(os.fsdecode(path)), job, room, answer)


def _run(number: int, file: Path, job: Job, room: Room, answer: Callable[[Answer], None]) -> None:
    answer(Begun(number))
    try:
        done: Answer = store_file(number, file, Path(os.fsdecode(job.folder)), job.settings, room)
    except MemoryError:
        done = Done(
            number, reasons=("decoding it takes more memory than is allowed",), starved=True
        )
    except EnvironmentLacksError as error:
        done = Broken(error.message, error.hint)
    except Exception as error:
        traceback.print_exc()
        done = Done(number, reasons=(f"cannot be decoded ({error or type(error).__name__})",))
    answer(done)


def _load_libraries() -> None:
    """What most jobs need, so that it does not count as theirs."""
    import cv2
    import PIL.Image

    PIL.Image.init()
    cv2.setNumThreads(1)


def _limit_memory() -> None:
    """No more private memory than now and the budget, whatever a file's header hid (Linux)."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return
    now = next(int(s.split()[1]) * 1024 for s in status.splitlines() if s.startswith("VmData:"))
    limit = now + BUDGET + _BESIDE
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


if __name__ == "__main__":
    main()
