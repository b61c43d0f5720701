"""Two servers and two workers behind one address, killed one after the other under load."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

import pytest
from gym.tests.postgres import postgres_programs
from gym.tests.running import wait_for
from gym.tests.two_servers import board_is_right, figures, load, open_jobs, two_servers


@pytest.mark.slow
def test_killed_servers_lose_nothing_that_they_acknowledged(
    lacks: Callable[[str], NoReturn],
) -> None:
    if postgres_programs() is None:
        lacks("PostgreSQL is not installed (Debian: apt-get install postgresql)")
    with two_servers() as site:
        load(site, seconds=45, every_s=4)
        wait_for(lambda: open_jobs(site) == 0)
        found = figures(site)
        assert board_is_right(site)
    assert sum(found["kills"].values()) >= 2
    assert min(found["acknowledged"].values()) > 10
    assert set(found["lost"].values()) == {0}
    assert found["refused"] == []
    assert found["board"]["messages"] > 10
    # A worker that dies between a message and its commit sends it again, with the same id.
    workers = sum(n for name, n in found["kills"].items() if name.startswith("worker"))
    assert found["webhooks"]["delivered twice"] <= 8 * workers
