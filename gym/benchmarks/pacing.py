"""Requests at a steady rate, whatever the server takes for each."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine


async def paced(
    rate: float, seconds: float, one: Callable[[int, float], Coroutine[None, None, None]]
) -> None:
    """Begin `rate` requests a second and wait for all.

    Parameters
    ----------
    one : makes the request of a number; the second word is when it was due (perf_counter), so that
        what waits behind a slow answer counts as slow, too.
    """
    begun = time.perf_counter()
    requests: list[asyncio.Task[None]] = []
    for number in range(int(rate * seconds)):
        due = begun + number / rate
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        requests.append(asyncio.create_task(one(number, due)))
    await asyncio.gather(*requests)
