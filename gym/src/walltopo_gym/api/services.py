"""What the endpoints share: made once when the server starts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address, ip_network
from typing import Annotated

from fastapi import Depends, Request
from sqlalchemy.orm import Session

from walltopo_gym.accounts.passwords import Passwords
from walltopo_gym.competitions.live import LiveBoards
from walltopo_gym.database.engine import Database
from walltopo_gym.editing.desks import Desks
from walltopo_gym.mail import Mailer, make_mailer
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, open_store, private_folder
from walltopo_gym.uploads.incoming import Incoming

_READING = {"GET", "HEAD", "OPTIONS"}


@dataclass(frozen=True)
class Services:
    """The settings, the database, and what speaks to the world outside."""

    settings: GymSettings
    database: Database
    passwords: Passwords
    mailer: Mailer
    store: FileStore
    incoming: Incoming
    desks: Desks

    @classmethod
    def open(cls, settings: GymSettings) -> Services:
        """All of them, as the settings say."""
        private_folder(settings.data)
        database, store = Database(settings.database_url), open_store(settings)
        return cls(
            settings,
            database,
            Passwords(),
            make_mailer(settings),
            store,
            Incoming(
                settings.data / "incoming", settings.keep_free_mb, copied=not settings.objects
            ),
            Desks(settings.data / "editing", settings.most_edited, database, store),
        )

    def close(self) -> None:
        """Wait for what was begun, and close the connections."""
        self.desks.close()
        self.database.close()


# Coroutines, though they await nothing: a function would be called in a thread of its own.
async def _services(request: Request) -> Services:
    services: Services = request.app.state.services
    return services


ServicesOf = Annotated[Services, Depends(_services)]


async def _boards(request: Request) -> LiveBoards:
    boards: LiveBoards = request.app.state.boards
    return boards


BoardsOf = Annotated[LiveBoards, Depends(_boards)]


def is_reading(request: Request) -> bool:
    """Whether the request changes nothing, by its method."""
    return request.method in _READING


def _session(request: Request, services: ServicesOf) -> Iterator[Session]:
    database = services.database
    with database.reading() if is_reading(request) else database.writing() as session:
        yield session


# Ended when the endpoint returns: what was answered has been committed.
Db = Annotated[Session, Depends(_session, scope="function")]


def network_of(request: Request) -> str:
    """The asker's address, as the nearest proxy that is believed says it; of IPv6 the network of
    64 bits, for one household has all of that."""
    told = request.client.host if request.client else ""
    try:
        address = ip_address(told)
    except ValueError:
        return told
    if isinstance(address, IPv6Address):
        return str(address.ipv4_mapped or ip_network((int(address) >> 64 << 64, 64)))
    return told
