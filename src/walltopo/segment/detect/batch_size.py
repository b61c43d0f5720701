"""How many tiles a network looks at in one go: as many as memory takes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_BYTES = 160  # per pixel of input, outputs included; 100 measured for the shipped network
_SHARE = 0.5  # of free memory
_MOST = 16

Arrays = list[NDArray[np.float32]]


def free_memory() -> int | None:
    """Bytes the system could still give; None where it does not say."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        facts = dict(line.split(":", 1) for line in lines)
        return int(facts["MemAvailable"].split()[0]) * 1024
    except (OSError, KeyError, ValueError, IndexError):
        return None


def in_batches(
    inputs: Sequence[NDArray[np.generic]], most: int, free: int | None
) -> Iterator[list[int]]:
    """Positions of inputs that go together: neighbours of one shape, not too many.

    Parameters
    ----------
    inputs : without the axis of photos.
    most : not more than this; 0 means as many as fit into half of `free` bytes.
    """
    batch: list[int] = []
    for k, values in enumerate(inputs):
        pixels = values.size / 3
        fit = _MOST if free is None else int(_SHARE * free / (_BYTES * pixels))
        limit = max(1, most or min(fit, _MOST))
        if batch and (values.shape != inputs[batch[0]].shape or len(batch) >= limit):
            yield batch
            batch = []
        batch.append(k)
    if batch:
        yield batch


def run_batched(
    run: Callable[[NDArray[np.generic]], Arrays],
    inputs: Sequence[NDArray[np.generic]],
    most: int,
) -> list[Arrays]:
    """Outputs of each input; a batch that a GPU has no memory for is halved.

    Parameters
    ----------
    run : from (n, ...) inputs to outputs with n first.
    """
    outputs: list[Arrays] = []
    waiting = list(in_batches(inputs, most, free_memory()))
    while waiting:
        batch = waiting.pop(0)
        try:
            made = run(np.stack([inputs[k] for k in batch]))
        except Exception as error:  # ONNX Runtime's kinds do not tell why
            if len(batch) == 1 or "alloc" not in str(error).lower():
                raise
            half = len(batch) // 2
            waiting[:0] = [batch[:half], batch[half:]]
            continue
        outputs += [[part[k] for part in made] for k in range(len(batch))]
    return outputs
