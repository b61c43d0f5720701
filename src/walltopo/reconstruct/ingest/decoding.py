"""Decoding in a child process that may die: what it died of is left out, the rest goes on."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import IO, Final

import msgspec

from walltopo.core import EnvironmentLacksError, Progress, StageError
from walltopo.core.children import child_process, ending, python_module
from walltopo.reconstruct.ingest.decode_job import Answer, Begun, Broken, Done, Job
from walltopo.reconstruct.ingest.settings import IngestSettings

_THREADS: Final = 4


def decode_files(
    files: Sequence[tuple[int, Path]], folder: Path, settings: IngestSettings, progress: Progress
) -> Generator[Done]:
    """What each numbered file gave, in the order in which they are done.

    When the process dies, or runs out of memory, the files that it had begun are decoded again,
    each alone; what it dies of then is left out.

    Raises
    ------
    EnvironmentLacksError : no space left.
    StageError : the process cannot do anything at all.
    """
    waiting, alone = dict(files), dict[int, Path]()
    while waiting or alone:
        first = min(alone, default=-1)
        batch = waiting or {first: alone.pop(first)}
        single = len(batch) == 1
        decoder = _Decoder(Job(_as_bytes(batch), os.fsencode(folder), settings, _THREADS))
        begun: set[int] = set()
        with closing(decoder.answers()) as answers:
            for answer in answers:
                if isinstance(answer, Broken):
                    raise EnvironmentLacksError(answer.message, answer.hint)
                if isinstance(answer, Begun):
                    begun.add(answer.number)
                    continue
                begun.discard(answer.number)
                file = batch.pop(answer.number)
                if answer.starved and not single:
                    alone[answer.number] = file
                else:
                    yield answer
        for line in decoder.told:
            progress.detail(f"decoder: {line}")
        if batch and not begun:
            raise StageError(
                "\n".join([f"decoding photos ended ({decoder.end})", *decoder.told[-8:]])
            )
        for number in sorted(begun):
            file = batch.pop(number)
            if single:
                yield Done(number, reasons=(f"its decoder crashed ({decoder.end})",))
            else:
                alone[number] = file


def _as_bytes(files: dict[int, Path]) -> dict[int, bytes]:
    return {number: os.fsencode(file) for number, file in files.items()}


class _Decoder:
    """One run of `decode_worker`."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self.told: list[str] = []
        self.end = ""

    def answers(self) -> Generator[Answer]:
        """Yield its answers; afterwards `end` says how it ended and `told` what it printed."""
        command = python_module("walltopo.reconstruct.ingest.decode_worker")
        message = msgspec.json.encode(self.job) + b"\n"
        with tempfile.TemporaryFile() as printed:
            try:
                with child_process(
                    command, message, environment=_ENVIRONMENT, errors=printed
                ) as child:
                    for line in child.output:
                        yield msgspec.json.decode(line, type=Answer)
                    self.end = ending(child.wait())
            finally:
                self.told = _tail(printed)


# Large blocks go back to the system when they are freed, and BLAS starts no threads.
_ENVIRONMENT: Final = {
    "MALLOC_MMAP_THRESHOLD_": "1048576",
    "MALLOC_TRIM_THRESHOLD_": "1048576",
    "OPENBLAS_NUM_THREADS": "1",
}


def _tail(printed: IO[bytes]) -> list[str]:
    """The last of what libraries printed; the file is theirs to fill."""
    printed.seek(max(0, printed.seek(0, os.SEEK_END) - 4000))
    return printed.read().decode("utf-8", "replace").splitlines()
