"""Run the jobs of a batch on this machine, or on the machines of a Ray cluster."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any, TypeVar

import msgspec

from walltopo.core import EnvironmentLacksError
from walltopo.core.memory import free_memory
from walltopo.core.parallel import available_cores
from walltopo.pipeline.batch.job import Outcome, ScanJob
from walltopo.pipeline.batch.remote import run_anywhere

# Cores and memory of one scan, to limit parallel scans; a wall of 72 photos stays below them.
_CORES_PER_SCAN, _BYTES_PER_SCAN = 2, 4 << 30


def default_parallel_scans() -> int:
    """Return how many scans fit the cores and the free memory of this machine, at least one."""
    return max(1, min(available_cores() // _CORES_PER_SCAN, free_memory() // _BYTES_PER_SCAN))


def run_here(jobs: Sequence[ScanJob], at_once: int, threads: int = 0) -> Iterator[Outcome]:
    """Run jobs in parallel processes of this machine; yield outcomes as they finish."""
    pool = ThreadPoolExecutor(at_once)
    try:
        futures = [pool.submit(run_anywhere, job, threads) for job in jobs]
        for done in as_completed(futures):
            yield done.result()
    finally:
        # After Ctrl-C no further scan starts; running scans are killed with this process.
        pool.shutdown(wait=False, cancel_futures=True)


def run_on_cluster(jobs: Sequence[ScanJob], cores: int, memory: int) -> Iterator[Outcome]:
    """Run each job as a task of the connected Ray cluster; yield outcomes as they finish.

    Parameters
    ----------
    cores, memory : cores and bytes of one scan; Ray starts only as many scans as fit.

    Raises
    ------
    EnvironmentLacksError : no machine of the cluster has so many cores or so much memory.
    """
    import ray

    _check_resources(cores, memory)
    task = ray.remote(_task).options(num_cpus=cores, memory=memory, max_retries=TRIES)
    running = {task.remote(msgspec.json.encode(job), cores): job for job in jobs}
    while running:
        (reference,), _ = ray.wait(list(running), num_returns=1)
        job = running.pop(reference)
        try:
            yield msgspec.json.decode(ray.get(reference), type=Outcome)
        except ray.exceptions.RayTaskError as error:
            message = f"defect in walltopo: {error.cause!r}"
            yield Outcome(out=job.out, state="failed", error=message)
        except ray.exceptions.RayError as error:
            yield Outcome(
                out=job.out, state="lost", tries=TRIES + 1, error=describe_loss(error) or str(error)
            )


def _task(packed: bytes, threads: int) -> bytes:
    return msgspec.json.encode(run_anywhere(msgspec.json.decode(packed, type=ScanJob), threads))


def _check_resources(cores: int, memory: int) -> None:
    """Raise EnvironmentLacksError if no machine fits a task, because Ray would wait forever."""
    import ray

    nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
    if not any(node.get("CPU", 0) >= cores and node.get("memory", 0) >= memory for node in nodes):
        max_cores = max((int(node.get("CPU", 0)) for node in nodes), default=0)
        largest = max((node.get("memory", 0) for node in nodes), default=0) / (1 << 30)
        raise EnvironmentLacksError(
            f"no machine of the cluster has {cores} cores and {memory / (1 << 30):.1f} GB for a "
            f"scan: the largest have {max_cores} cores and {largest:.1f} GB",
            "Request less with --cores and --memory.",
        )


Shared = TypeVar("Shared")
Item = TypeVar("Item")
Result = TypeVar("Result")

TRIES = 3  # retries of a task after its process was lost
_INLINE = 64 << 10  # bytes of a result that still pass through the object store
_AHEAD = 2  # tasks that wait at each core, so that none is idle
_CONNECT_TIMEOUT_S = 10.0
_STORE_BYTES = 128 << 20  # object store of a cluster that is started here


@contextmanager
def on_cluster(address: str, cores: int | None = None) -> Iterator[None]:
    """Connect to a Ray cluster during the block.

    Parameters
    ----------
    address : "auto" for the cluster that runs on this machine, "local" to start one for the block,
        else the address of the head.
    cores : cores of a started cluster; None: all.

    Raises
    ------
    EnvironmentLacksError : Ray is not installed, or the cluster is unreachable or of another
        version.
    """
    # Ray's usage statistics are off unless the user enables them.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        import ray
    except ImportError as error:
        raise EnvironmentLacksError(
            f"--ray {address} needs Ray, which is not installed here ({error})",
            "pip install 'walltopo[ray]'",
        ) from error
    _check_reachable(address)
    own: dict[str, Any] = {}
    if address == "local":
        own = {"include_dashboard": False, "object_store_memory": _STORE_BYTES, "num_cpus": cores}
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


def _check_reachable(address: str) -> None:
    """Raise EnvironmentLacksError if the head is unreachable; Ray itself would retry for
    minutes."""
    host, colon, port = address.rpartition(":")
    if not colon or "://" in address or not port.isdecimal():
        return
    try:
        socket.create_connection((host, int(port)), _CONNECT_TIMEOUT_S).close()
    except (OSError, OverflowError) as error:
        raise EnvironmentLacksError(
            f"no Ray cluster at {address!r}: {error}",
            "Start one with `ray start --head` and give its address, or use --ray local.",
        ) from error


def describe_loss(error: Exception) -> str:
    """Return how Ray lost a task for good; "" for other errors."""
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
