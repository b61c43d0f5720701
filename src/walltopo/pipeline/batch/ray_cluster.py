"""Ray's cluster as `Workers`: each item a task, on any machine that sees the same folders.

Ray is an optional extra. What passes between processes is small: items are paths and numbers,
and a result that is large is left as a file in the scan's own scratch folder, so that Ray's
object store never holds a picture. A task whose process or machine is lost is done again elsewhere.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
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
