"""Ray's cluster as `Workers`: each item a task, on any machine that sees the same folders.

Ray is an optional extra. What passes between processes is small: items are paths and numbers,
and a result that is large is left as a file in the scan's own scratch folder, so that Ray's
object store never holds a picture. A task whose process or machine is lost is done again elsewhere.
"""

from __future__ import annotations

import os
import pickle
import socket
import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from walltopo.core import EnvironmentLacksError

Shared = TypeVar("Shared")
Item = TypeVar("Item")
Result = TypeVar("Result")

TRIES = 3  # times that a task is begun again after its process was lost
_INLINE = 64 << 10  # bytes of a result that still pass through the object store
_AHEAD = 2  # tasks that wait at each core, so that none is idle
_PATIENCE_S = 10.0  # for the head to answer
_STORE = 128 << 20  # bytes of the object store of a cluster that is started here


@contextmanager
def on_cluster(address: str, cores: int | None = None) -> Iterator[None]:
    """Be connected to a Ray cluster in the block.

    Parameters
    ----------
    address : "auto" for the one that runs on this machine, "local" to start one that ends with
        the block, else that of its head.
    cores : of one that is started; all of the machine's where None.

    Raises
    ------
    EnvironmentLacksError : Ray is not installed, there is no such cluster, or it is of another
        version.
    """
    # Nothing is told to anybody, unless who runs this wants it.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        import ray
    except ImportError as error:
        raise EnvironmentLacksError(
            f"--ray {address} needs Ray, which is not installed here ({error})",
            "pip install 'walltopo[ray]'",
        ) from error
    _check_answers(address)
    own: dict[str, Any] = {}
    if address == "local":
        own = {"include_dashboard": False, "object_store_memory": _STORE, "num_cpus": cores}
    try:
        ray.init(address, log_to_driver=False, logging_level="ERROR", **own)
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise EnvironmentLacksError(
            f"no Ray cluster at {address!r}: {str(error).strip().splitlines()[0]}",
            "Start one with `ray start --head` and give its address, or use --ray local.",
        ) from error
    try:
        yield
    finally:
        ray.shutdown()


def _check_answers(address: str) -> None:
    """Ray itself asks a head that is not there for minutes."""
    host, colon, port = address.rpartition(":")
    if not colon or "://" in address or not port.isdecimal():
        return
    try:
        socket.create_connection((host, int(port)), _PATIENCE_S).close()
    except (OSError, OverflowError) as error:
        raise EnvironmentLacksError(
            f"no Ray cluster at {address!r}: {error}",
            "Start one with `ray start --head` and give its address, or use --ray local.",
        ) from error


def lost(error: Exception) -> str:
    """How Ray lost a task for good; empty where the error is another."""
    from ray import exceptions

    kinds = (
        exceptions.WorkerCrashedError,
        exceptions.NodeDiedError,
        exceptions.OutOfMemoryError,
        exceptions.ObjectLostError,
    )
    if not isinstance(error, kinds):
        return ""
    return f"its process was lost {TRIES + 1} times ({type(error).__name__})"


@dataclass(frozen=True)
class RayWorkers:
    """The cluster that this process is connected to.

    Parameters
    ----------
    threads : cores of a task; its libraries use as many threads.
    memory : bytes of a task that Ray reckons with.
    scratch : where large results are left; on a disk that all machines see.
    """

    threads: int = 1
    memory: int = 1 << 30
    scratch: Path | None = None

    def within(self, scratch: Path) -> RayWorkers:
        """The same, with this folder for large results."""
        return replace(self, scratch=scratch.absolute())

    def map(
        self,
        prepare: Callable[[], Shared],
        work: Callable[[Shared, Item], Result],
        items: Sequence[Item],
        *,
        threaded: bool = False,
    ) -> Iterator[Result]:
        """See `Workers.map`; each task is a thread of a process of its own in any case.

        Raises
        ------
        EnvironmentLacksError : a task was lost again and again; and whatever the task raises.
        """
        import ray

        assert self.scratch is not None
        cores = int(ray.cluster_resources().get("CPU", 1))
        call = ray.put(ray.cloudpickle.dumps((prepare, work)))
        options = {"num_cpus": self.threads, "memory": self.memory, "max_retries": TRIES}
        task = ray.remote(_work).options(**options)
        setting = _Setting(call.hex(), os.getcwd(), str(self.scratch), self.threads)
        waiting = deque(items)
        running: deque[Any] = deque()
        while waiting or running:
            while waiting and len(running) < _AHEAD * cores + 1:
                # In a list, so that Ray does not fetch it for a process that has it already.
                running.append(task.remote(setting, [call], waiting.popleft()))
            yield _fetched(running.popleft())


@dataclass(frozen=True)
class _Setting:
    """What a process on the cluster must know before it unpacks any work."""

    name: str
    folder: str
    scratch: str
    threads: int


def _fetched(reference: Any) -> Any:
    """The result of a task."""
    import ray

    try:
        packed, left = ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
    except ray.exceptions.RayError as error:
        raise EnvironmentLacksError(
            f"the Ray cluster gave a task up: {lost(error) or error}",
            "Run the same command again to go on; fewer tasks at a time need less memory.",
        ) from error
    if not left:
        return pickle.loads(packed)
    content = Path(left).read_bytes()
    Path(left).unlink()
    return pickle.loads(content)


# What the running process prepared last, and for which call: one, so that memory stays bounded.
_prepared: dict[str, tuple[Any, Any]] = {}


def _work(setting: _Setting, call: list[Any], item: Any) -> tuple[bytes, str]:
    """One task, on the cluster: the result packed, or the file that it was left in."""
    import ray

    if setting.name not in _prepared:
        _prepared.clear()
        os.chdir(setting.folder)
        _limit(setting.threads)
        prepare, work = pickle.loads(ray.get(call[0]))
        _prepared[setting.name] = (prepare(), work)
    shared, work = _prepared[setting.name]
    packed = pickle.dumps(work(shared, item), protocol=5)
    if len(packed) <= _INLINE:
        return packed, ""
    number, path = tempfile.mkstemp(dir=setting.scratch, prefix="result-")
    with os.fdopen(number, "wb") as stream:
        stream.write(packed)
    return b"", path


def _limit(threads: int) -> None:
    """Let libraries use only the cores that the task has."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = str(threads)
    import cv2

    cv2.setNumThreads(threads)
