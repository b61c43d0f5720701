"""Batches as tensors on the training device, made by a thread or by worker processes.

A crop of 640 px costs 25 ms of a core, and a GPU trains on 200 of them a second. For a GPU, crops
are therefore made in processes, and a thread moves the batches on a stream of its own.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Iterator
from contextlib import suppress
from typing import Any

import torch
from torch import Tensor
from torch import multiprocessing as processes

from walltopo.core import StageError
from walltopo.core.parallel import available_cores
from walltopo_lab.train.batches import CropSource, batches
from walltopo_lab.train.params import TrainSettings

TensorBatch = dict[str, Tensor]
_SPARE_CORES = 2  # for the training step and the thread that moves batches
_PER_WORKER = 2  # finished batches that may wait, per worker
_READY = 3  # batches on the device that may wait
_ALIVE_EVERY = 5.0  # s between checks that all workers live
# Types in which a batch travels; a step converts all to float32.
_COMPACT = {
    "heat": torch.float16,
    "heat_weight": torch.uint8,
    "votes": torch.float16,
    "vote_weight": torch.float16,
    "mask": torch.uint8,
    "mask_weight": torch.float16,
}


def worker_count(settings: TrainSettings, device: torch.device) -> int:
    """Return the number of processes that make crops; 0 is a thread of this process."""
    if settings.workers or device.type != "cuda":
        return settings.workers
    return max(1, available_cores() - _SPARE_CORES)


def supply(
    source: CropSource, seed: int, device: torch.device
) -> Generator[TensorBatch, None, None]:
    """Yield batches on `device` without end.

    Yields
    ------
    `image` (n, 3, S, S) float32 RGB in 0..255, channels last; the fields of `Targets`, float32
    with a leading n.

    Raises
    ------
    StageError : a worker process ended.
    """
    count = worker_count(source.settings, device)
    made: Iterator[TensorBatch]
    if count:
        made = _from_processes(source, seed, count)
    else:
        made = (_tensors(batch) for batch in batches(source, seed))
    if device.type == "cuda":
        made = _on_gpu(made, device)
    for batch in made:
        ready = {name: value.float() for name, value in batch.items()}
        ready["image"] = ready["image"].contiguous(memory_format=torch.channels_last)
        yield ready


def _tensors(batch: Any) -> TensorBatch:
    return {name: torch.from_numpy(array) for name, array in batch.items()}


def _supply_batches(source: CropSource, seed: int, ready: Any) -> None:
    """Put compact batches into a queue until the process is ended."""
    torch.set_num_threads(1)
    for batch in batches(source, seed):
        tensors = _tensors(batch)
        ready.put({name: t.to(_COMPACT.get(name, t.dtype)) for name, t in tensors.items()})


def _from_processes(source: CropSource, seed: int, count: int) -> Iterator[TensorBatch]:
    """Yield the batches of `count` processes, each with a seed of its own."""
    context = processes.get_context("spawn")  # a forked process would inherit the GPU's state
    ready: Any = context.Queue(maxsize=_PER_WORKER * count)
    workers = [
        context.Process(
            target=_supply_batches,
            args=(source, seed + k, ready),
            daemon=True,
        )
        for k in range(1, count + 1)
    ]
    for worker in workers:
        worker.start()
    try:
        while True:
            try:
                yield ready.get(timeout=_ALIVE_EVERY)
            except queue.Empty:
                ended = [worker.exitcode for worker in workers if worker.exitcode is not None]
                if ended:
                    raise StageError(
                        f"a process that makes crops ended with code {ended[0]}"
                    ) from None
    finally:
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join()


def _on_gpu(source: Iterator[TensorBatch], device: torch.device) -> Iterator[TensorBatch]:
    """Yield batches on a GPU; a thread copies them from pinned memory beside the computation."""
    ready: queue.Queue[TensorBatch | BaseException] = queue.Queue(maxsize=_READY)
    over = threading.Event()
    stream = torch.cuda.Stream(device)

    def put(item: TensorBatch | BaseException) -> None:
        while not over.is_set():
            with suppress(queue.Full):
                ready.put(item, timeout=1.0)
                return

    def move() -> None:
        try:
            for batch in source:
                with torch.cuda.stream(stream):
                    moved = {
                        name: value.pin_memory().to(device, non_blocking=True)
                        for name, value in batch.items()
                    }
                stream.synchronize()  # the pinned memory must outlive the copy
                put(moved)
                if over.is_set():
                    return
        except BaseException as error:  # passed to the consumer, which raises it
            put(error)

    mover = threading.Thread(target=move, daemon=True)
    mover.start()
    try:
        while True:
            item = ready.get()
            if isinstance(item, BaseException):
                raise item
            for value in item.values():
                # The memory belongs to the copying stream: keep it until this one has used it.
                value.record_stream(torch.cuda.current_stream(device))
            yield item
    finally:
        over.set()
        mover.join()
