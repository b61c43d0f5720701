"""A watched child process that reads files, so that a crash or hang leaves the parent alive.

    python -m tools.fuzz.watched FOLDER

waits for target names on standard input, runs each target's reader on FOLDER, and answers with a
line of JSON. The process serves many files and is replaced after it dies.
"""

from __future__ import annotations

import json
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

PROBE = "probe"  # runs code.py; the tests of the watch use it

MAX_SECONDS = 10.0  # processor time, because other processes may delay the wall clock
MAX_WAIT = 120.0
MAX_MEMORY = 2 << 30


@dataclass(frozen=True)
class Outcome:
    """The result of a target's reader on some files.

    Parameters
    ----------
    kind : "read", "refused" (an error meant for users), or a finding: "defect", "crash", "hang",
        "memory".
    text : the message, or the location of the defect.
    """

    kind: str
    text: str

    @property
    def bad(self) -> bool:
        """Return whether the outcome is a finding."""
        return self.kind not in ("read", "refused")


class Watched:
    """The child process; `read` passes files to it."""

    def __init__(self) -> None:
        base = "/dev/shm" if Path("/dev/shm").is_dir() else None
        self._root = Path(tempfile.mkdtemp(prefix="walltopo-fuzz-", dir=base))
        self._child: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Watched:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self._end()
        shutil.rmtree(self._root, ignore_errors=True)

    def read(self, target: str, files: Mapping[str, bytes]) -> Outcome:
        """Write the files into an empty folder, run a target's reader on them, and return the
        outcome.
        """
        folder = self._root / "in"
        shutil.rmtree(folder, ignore_errors=True)
        for name, data in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        child = self._started()
        assert child.stdin is not None
        assert child.stdout is not None
        child.stdin.write(target.encode() + b"\n")
        child.stdin.flush()
        outcome = self._answer(child)
        stray = sorted(item.name for item in self._root.iterdir() if item.name != "in")
        if stray:
            self._end()
            shutil.rmtree(self._root)
            self._root.mkdir()
            return Outcome("defect", f"wrote outside its folder: {stray}")
        return outcome

    def _answer(self, child: subprocess.Popen[bytes]) -> Outcome:
        assert child.stdout is not None
        began, used = time.monotonic(), _processor_seconds(child.pid)
        while not select.select([child.stdout], [], [], 0.5)[0]:
            slow = _processor_seconds(child.pid) - used > MAX_SECONDS
            if slow or time.monotonic() - began > MAX_WAIT:
                self._end()
                return Outcome("hang", f"over {MAX_SECONDS:.0f} s")
        line = child.stdout.readline()
        if line:
            answer: dict[str, Any] = json.loads(line)
            return Outcome(answer["kind"], answer["text"])
        code = child.wait()
        self._end()
        return Outcome("crash", signal.Signals(-code).name if code < 0 else f"exit {code}")

    def _started(self) -> subprocess.Popen[bytes]:
        if self._child is None:
            command = [sys.executable, "-m", "tools.fuzz.watched", str(self._root / "in")]
            self._child = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
            )
            assert self._child.stdout is not None
            if self._child.stdout.readline() != b"ready\n":
                raise RuntimeError(f"does not start; try it by hand: {' '.join(command)}")
        return self._child

    def _end(self) -> None:
        if self._child is not None:
            self._child.kill()
            self._child.communicate()
            self._child = None


def _processor_seconds(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _ran_out(error: BaseException | None) -> bool:
    """Return whether any error in the chain reports exhausted memory."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _try(target: str, folder: Path) -> Outcome:
    from tools.fuzz.targets import TARGETS
    from walltopo.core import WalltopoError

    try:
        if target == PROBE:
            exec((folder / "code.py").read_text(), {"folder": folder})
        else:
            TARGETS[target].read(folder)
    except WalltopoError as error:
        if _ran_out(error):
            return Outcome("memory", error.message)
        return Outcome("refused", error.message)
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if "walltopo" in frame.filename][-1:]
        where = " ".join(f"{Path(f.filename).name}:{f.lineno}" for f in own)
        return Outcome("defect", f"{type(error).__name__} at {where}: {str(error)[:300]}")
    return Outcome("read", "")


def _serve(folder: Path) -> None:
    """Answer requests until standard input ends."""
    from tools.fuzz.targets import warm

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries print to descriptor 1
    warm()
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * os.sysconf("SC_PAGE_SIZE") + MAX_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        outcome = _try(line.strip(), folder)
        text = outcome.text.encode("utf-8", "backslashreplace").decode()
        print(json.dumps({"kind": outcome.kind, "text": text}), file=answers, flush=True)


if __name__ == "__main__":
    _serve(Path(sys.argv[1]))
