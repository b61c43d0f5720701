"""A flood of one gym's photos holds up no other gym's."""

from __future__ import annotations

import pytest
from gym.tests.hurried import at_work, forget_jobs
from gym.tests.running import wait_for
from gym.tests.scans.test_gym_uploads import jpeg
from gym.tests.worlds import Server, World, make_world
from sqlalchemy import func, select

from walltopo_gym.jobs.queue import Task
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.scans.photo_checks import PhotoChecks
from walltopo_gym.scans.queues import BATCHES, queue_batch


def received(world: World) -> int:
    """Return how many of the gym's photos nobody has looked at."""
    ours = select(func.count(Photo.id)).join(Scan).where(Scan.wall_id == world.wall.id)
    with world.server.database.reading() as session:
        return session.scalar(ours.where(Photo.state == "received")) or 0


@pytest.mark.slow
def test_a_flood_of_photos_delays_no_other_gyms(server: Server) -> None:
    forget_jobs(server)
    server.services.store.put("originals/flood", jpeg(40))
    flooded, other = make_world(server), make_world(server)
    scans = (flooded.scan(), other.scan())
    for number in range(100):
        flooded.photo(scans[0], state="received", sha256="flood", name=f"{number}.jpg")
    other.photo(scans[1], state="received", sha256="flood", name="other.jpg")
    with server.database.writing() as session:
        for scan in scans:
            queue_batch(session, scan)
    checks = PhotoChecks(server.database, server.services.store)
    with at_work(server, Task(BATCHES, checks.check_batch)):
        wait_for(lambda: not received(other))
        assert received(flooded) >= 100 - 3 * 16
        wait_for(lambda: not received(flooded))
