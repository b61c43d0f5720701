"""Ten scans queued by three gyms: does one gym's pile delay the others?

    python -m gym.benchmarks.fair [--database URL]

The first gym queues eight scans, then the second and the third one each; two workers take them. The
photos show noise, so each scan ends after its first stages: it is the order that is measured.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from uuid import UUID

from gym.tests.running import Process
from gym.tests.worlds import Server, World, make_world
from PIL import Image
from sqlalchemy import select

from walltopo_gym.scans.models import Scan

QUEUED = (8, 1, 1)
_OVER = {"review", "failed"}


def queued(server: Server, worlds: Sequence[World]) -> dict[UUID, int]:
    """Scans of noise, asked for one gym after the other; each with the number of its gym."""
    for number in range(3):
        content = BytesIO()
        Image.effect_noise((640, 480), 70 + number).convert("RGB").save(content, "JPEG")
        server.services.store.put(f"originals/noise{number}", content.getvalue())
    scans = {}
    for gym, (world, many) in enumerate(zip(worlds, QUEUED, strict=True), start=1):
        for _ in range(many):
            scan = world.scan()
            for number in range(3):
                world.photo(scan, state="usable", sha256=f"noise{number}")
            path = f"{world.path}/scans/{scan}/start"
            assert server.ask("POST", path, world.people["setter"]).is_success
            scans[scan] = gym
    return scans


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--database", default="", help="of an empty PostgreSQL database")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as name:
        data = Path(name)
        server = Server(data, args.database)
        scans = queued(server, [make_world(server) for _ in QUEUED])
        settings = {"database": args.database} if args.database else {}
        workers = [Process(data, "worker", **settings) for _ in range(2)]
        begun: list[int] = []
        seen: set[UUID] = set()
        try:
            while True:
                with server.database.reading() as session:
                    states = dict(session.execute(select(Scan.id, Scan.state)).all())
                for scan, state in states.items():
                    if state not in ("queued", "uploading") and scan not in seen:
                        seen.add(scan)
                        begun.append(scans[scan])
                if all(state in _OVER for state in states.values()):
                    break
                time.sleep(0.1)
        finally:
            for worker in workers:
                worker.stop()
            server.close()
    print(f"queued: {', '.join(f'gym {n}: {many}' for n, many in enumerate(QUEUED, start=1))}")
    print(f"begun in this order, by gym: {' '.join(map(str, begun))}")
    print(f"all ended: {'yes' if len(begun) == sum(QUEUED) else 'no'}")
    for gym in (2, 3):
        print(f"gym {gym} waited for {begun[: begun.index(gym)].count(1)} scans of gym 1")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
