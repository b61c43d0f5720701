"""What tests of the platform share: a server on each kind of database."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from gym.tests.worlds import Server, World, make_world, new_database
from sqlalchemy import delete

from walltopo_gym.accounts.models import Try


@pytest.fixture(scope="session", params=["sqlite", "postgresql"])
def server(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Server]:
    """A server that the tests of a session share; each makes people and gyms of its own."""
    url = ""
    if request.param == "postgresql":
        url = new_database(request.getfixturevalue("postgres"))
    made = Server(tmp_path_factory.mktemp("server"), url)
    yield made
    made.close()


@pytest.fixture(autouse=True)
def _fresh_limits(request: pytest.FixtureRequest) -> None:
    """All tests ask from one address: what one tried does not count for the next."""
    if "server" in request.fixturenames:
        made: Server = request.getfixturevalue("server")
        with made.database.writing() as session:
            session.execute(delete(Try))


@pytest.fixture
def world(server: Server) -> World:
    """A private gym with one wall and somebody in each role."""
    return make_world(server)
