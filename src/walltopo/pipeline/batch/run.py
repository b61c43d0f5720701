"""All scans of a batch, several at a time; one that fails does not end the others."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

import msgspec

from walltopo.core import EnvironmentLacksError
from walltopo.pipeline.batch.copied import run_anywhere
from walltopo.pipeline.batch.job import Job, Outcome
from walltopo.pipeline.batch.ray_cluster import TRIES, lost
from walltopo.segment.detect.batch_size import free_memory

# Of one scan, for how many may run at a time: the peak of a wall of 72 photos is below it.
_CORES, _BYTES = 2, 4 << 30


def jobs_for_here() -> int:
    """How many scans this machine has the cores and the free memory for; one at least."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    free = free_memory()
    by_memory = (cores or 1) if free is None else free // _BYTES
    return max(1, min((cores or 1) // _CORES, by_memory))


def run_here(jobs: Sequence[Job], at_once: int, threads: int = 0) -> Iterator[Outcome]:
    """Outcomes as they come, by so many processes of this machine."""
    pool = ThreadPoolExecutor(at_once)
    try:
        waiting = [pool.submit(run_anywhere, job, threads) for job in jobs]
        for done in as_completed(waiting):
            yield done.result()
    finally:
        # After Ctrl-C no other is begun; those that run end with this process.
        pool.shutdown(wait=False, cancel_futures=True)


def run_on_cluster(jobs: Sequence[Job], cores: int, memory: int) -> Iterator[Outcome]:
    """Outcomes as they come, each scan a task of the Ray cluster that we are connected to.

    Parameters
    ----------
    cores, memory : of one scan, cores and bytes: Ray begins no more at a time than there are.

    Raises
    ------
    EnvironmentLacksError : no machine of the cluster has so much.
    """
    import ray

    _check_room(cores, memory)
    task = ray.remote(_task).options(num_cpus=cores, memory=memory, max_retries=TRIES)
    running = {task.remote(msgspec.json.encode(job), cores): job for job in jobs}
    while running:
        (reference,), _ = ray.wait(list(running), num_returns=1)
        job = running.pop(reference)
        try:
            yield msgspec.json.decode(ray.get(reference), type=Outcome)
        except ray.exceptions.RayTaskError as error:
            told = f"defect in walltopo: {error.cause!r}"
            yield Outcome(out=job.out, state="failed", error=told)
        except ray.exceptions.RayError as error:
            yield Outcome(
                out=job.out, state="lost", tries=TRIES + 1, error=lost(error) or str(error)
            )


def _task(packed: bytes, threads: int) -> bytes:
    return msgspec.json.encode(run_anywhere(msgspec.json.decode(packed, type=Job), threads))


def _check_room(cores: int, memory: int) -> None:
    """A task that fits nowhere would wait for ever."""
    import ray

    nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
    if not any(node.get("CPU", 0) >= cores and node.get("memory", 0) >= memory for node in nodes):
        most = max((int(node.get("CPU", 0)) for node in nodes), default=0)
        largest = max((node.get("memory", 0) for node in nodes), default=0) / (1 << 30)
        raise EnvironmentLacksError(
            f"no machine of the cluster has {cores} cores and {memory / (1 << 30):.1f} GB for a "
            f"scan: the largest have {most} cores and {largest:.1f} GB",
            "Ask for less by --cores and --memory.",
        )
