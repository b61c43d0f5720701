"""A process that reads what it is given, watched: a crash, a hang or a defect ends no one else.

    python -m walltopo_lab.fuzz.watched FOLDER

waits for names of targets on its standard input, lets each read the files in FOLDER, and answers
with a line of JSON. It lives on from file to file and is replaced when it dies.
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

PROBE = "probe"  # runs code.py: what tests of the watch itself give it

MOST_SECONDS = 10.0  # of the processor: others may keep it busy
MOST_WAIT = 120.0
MOST_MEMORY = 2 << 30


@dataclass(frozen=True)
class Outcome:
    """What a target made of files.

    Parameters
    ----------
    kind : "read", "refused" (an error meant for people), or a find: "defect", "crash",
        "hang", "memory".
    text : the message, or where the defect is.
    """

    kind: str
    text: str

    @property
    def bad(self) -> bool:
        """Whether it is a find."""
        return self.kind not in ("read", "refused")


class Watched:
    """The process; `read` hands it files."""

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
        """Let a target read files, given by their names in a folder of their own."""
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
            slow = _processor_seconds(child.pid) - used > MOST_SECONDS
            if slow or time.monotonic() - began > MOST_WAIT:
                self._end()
                return Outcome("hang", f"over {MOST_SECONDS:.0f} s")
        line = child.stdout.readline()
        if line:
            answer: dict[str, Any] = json.loads(line)
            return Outcome(answer["kind"], answer["text"])
        code = child.wait()
        self._end()
        return Outcome("crash", signal.Signals(-code).name if code < 0 else f"exit {code}")

    def _started(self) -> subprocess.Popen[bytes]:
        if self._child is None:
            command = [sys.executable, "-m", "walltopo_lab.fuzz.watched", str(self._root / "in")]
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
    """Whether memory ran out on the way to an error, however it is told."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _try(target: str, folder: Path) -> Outcome:
    from walltopo.core import WalltopoError
    from walltopo_lab.fuzz.targets import TARGETS

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
    """Answer until standard input ends."""
    from walltopo_lab.fuzz.targets import warm

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries print there
    warm()
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * os.sysconf("SC_PAGE_SIZE") + MOST_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        outcome = _try(line.strip(), folder)
        text = outcome.text.encode("utf-8", "backslashreplace").decode()
        print(json.dumps({"kind": outcome.kind, "text": text}), file=answers, flush=True)


if __name__ == "__main__":
    _serve(Path(sys.argv[1]))
