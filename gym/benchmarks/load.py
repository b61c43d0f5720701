"""A server that was filled, asked at a steady rate: how long its answers take, and its processor time."""

from __future__ import annotations

import argparse
import asyncio
import os
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from gym.benchmarks.pacing import paced
from gym.tests.running import Process
from gym.tests.worlds import Server
from sqlalchemy import text

from walltopo.core.parallel import available_cores
from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.server.app import PREFIX

__all__ = ["Draw", "Prepare", "Request", "measure", "options"]

_WARM_S = 5.0


@dataclass(frozen=True)
class Request:
    """A request; `path` is below the API's prefix, `cookie` of the actor, `kind` its line."""

    kind: str
    path: str
    cookie: str = ""
    method: str = "GET"
    headers: Mapping[str, str] = field(default_factory=dict)
    body: Any = None


Draw = Callable[[int], Request]
"""The request of a number."""
Prepare = Callable[[httpx.AsyncClient], Awaitable[Draw]]
"""May ask for what its requests need, before any is timed."""


def options(about: str | None, rate: float, seconds: float) -> argparse.ArgumentParser:
    """Options of such a benchmark.

    Parameters
    ----------
    rate, seconds : the defaults.
    """
    parser = argparse.ArgumentParser(description=(about or "").splitlines()[0])
    parser.add_argument("--database", default="", help="of an empty PostgreSQL database")
    parser.add_argument("--rate", type=float, default=rate, help="requests a second")
    parser.add_argument("--seconds", type=float, default=seconds)
    return parser


def measure(fill: Callable[[Server], Prepare], args: argparse.Namespace) -> None:
    """Fill a new server, start it as a process, warm it, ask it, and print a line each kind."""
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        server = Server(data, args.database)
        prepare = fill(server)
        with server.database.writing() as session:
            session.execute(text("ANALYZE"))  # as the database does by itself in time
        server.close()
        settings = {"workers": "0", "requests_per_minute": "0"}
        settings |= {"database": args.database} if args.database else {}
        process = Process(data, "serve", "--port", "0", **settings)
        try:
            asyncio.run(_ask(process.first_line, prepare, args.rate, _WARM_S))
            before = cpu_s(process.pid)
            times, statuses = asyncio.run(
                _ask(process.first_line, prepare, args.rate, args.seconds)
            )
            spent = cpu_s(process.pid) - before
        finally:
            process.stop()
    _report(times, statuses, args)
    print(f"processor time of the server: {1000 * spent / sum(statuses.values()):.1f} ms a request")


async def _ask(
    address: str, prepare: Prepare, rate: float, seconds: float
) -> tuple[dict[str, list[float]], Counter[int]]:
    """Milliseconds of each kind of request, and statuses; 0 where no answer came."""
    times: dict[str, list[float]] = defaultdict(list)
    statuses: Counter[int] = Counter()
    limits = httpx.Limits(max_connections=200, max_keepalive_connections=50)
    async with httpx.AsyncClient(base_url=address + PREFIX, limits=limits, timeout=60) as client:
        draw = await prepare(client)

        async def one(asking: Request, due: float) -> None:
            headers = dict(asking.headers)
            if asking.cookie:
                headers["cookie"] = f"{COOKIE}={asking.cookie}"
            try:
                answer = await client.request(
                    asking.method, asking.path, headers=headers, json=asking.body
                )
                statuses[answer.status_code] += 1
            except httpx.HTTPError:
                statuses[0] += 1
            times[asking.kind].append(1000 * (time.perf_counter() - due))

        def drawn(number: int, due: float) -> Coroutine[None, None, None]:
            return one(draw(number), due)

        await paced(rate, seconds, drawn)
    return times, statuses


def cpu_s(pid: int) -> float:
    """Processor time of a process so far, all of its threads (proc(5))."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _report(
    times: dict[str, list[float]], statuses: Counter[int], args: argparse.Namespace
) -> None:
    """A line each kind, and all together."""
    kind = "PostgreSQL" if args.database else "SQLite"
    print(
        f"{kind}, {args.rate:.0f} requests a second for {args.seconds:.0f} s, "
        f"{available_cores()} cores, load {os.getloadavg()[0]:.1f}"
    )
    print(f"{'':<20} {'p50':>7} {'p95':>7} {'p99':>7} ms")
    whole = [value for values in times.values() for value in values]
    for name, values in [*sorted(times.items()), ("all", whole)]:
        p50, p95, p99 = np.percentile(values, [50, 95, 99])
        print(f"{name:<20} {p50:7.1f} {p95:7.1f} {p99:7.1f}")
    bad = sum(number for status, number in statuses.items() if status not in (200, 201, 204, 304))
    print(f"requests: {sum(statuses.values())}, errors: {bad}")
