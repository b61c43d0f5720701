"""Decode photos and videos in a child process (`python -m` this module).

Decoders are C libraries that read untrusted files. If one crashes here, or exceeds the memory limit
of ingest, only the file that it was decoding is lost.
"""

from __future__ import annotations

import os
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
from walltopo.reconstruct.ingest.decoding import (
    BUDGET,
    DecodeJob,
    Done,
    Fatal,
    MemoryBudget,
    Message,
    Started,
)
from walltopo.reconstruct.ingest.store import store_file

# Bytes for the stacks of the decoders' threads: RLIMIT_DATA counts them even if they are unused.
_THREAD_STACKS: Final = 160 * 2**20


def main() -> None:
    """Read one job from stdin and write messages to stdout; exit when the parent process exits."""
    messages = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # output printed by libraries must not mix with the messages
    job = msgspec.json.decode(sys.stdin.buffer.readline(), type=DecodeJob)
    end_with_parent()
    lock = threading.Lock()

    def send(value: Message) -> None:
        with lock:
            messages.write(msgspec.json.encode(value) + b"\n")

    _load_libraries()
    _limit_memory()
    budget = MemoryBudget()
    with ThreadPoolExecutor(max_workers=job.threads) as pool:
        for number, path in job.files.items():
            pool.submit(_decode, number, Path(os.fsdecode(path)), job, budget, send)


def _decode(
    number: int, file: Path, job: DecodeJob, budget: MemoryBudget, send: Callable[[Message], None]
) -> None:
    send(Started(number))
    try:
        done: Message = store_file(
            number, file, Path(os.fsdecode(job.folder)), job.settings, budget
        )
    except MemoryError:
        done = Done(
            number, reasons=("decoding it takes more memory than is allowed",), out_of_memory=True
        )
    except EnvironmentLacksError as error:
        done = Fatal(error.message, error.hint)
    except Exception as error:
        traceback.print_exc()
        done = Done(number, reasons=(f"cannot be decoded ({error or type(error).__name__})",))
    send(done)


def _load_libraries() -> None:
    """Import the libraries most files need, so that their memory and time count to no file."""
    import cv2  # noqa: F401
    import PIL.Image

    PIL.Image.init()


def _limit_memory() -> None:
    """Limit private memory to the present use plus the budget.

    Other systems than Linux cannot limit it; there `MemoryBudget` alone bounds the decoders.
    """
    if sys.platform != "linux":
        return
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return
    import resource

    used = next(int(s.split()[1]) * 1024 for s in status.splitlines() if s.startswith("VmData:"))
    limit = used + BUDGET + _THREAD_STACKS
    resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


if __name__ == "__main__":
    main()
