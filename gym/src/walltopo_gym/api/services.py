"""Shared objects of the endpoints, created once when the server starts."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from ipaddress import IPv6Address, ip_address, ip_network
from typing import Annotated, Any, Protocol, TypeVar, runtime_checkable

from fastapi import Depends, Request
from sqlalchemy.orm import Session

from walltopo_gym.database.engine import Database
from walltopo_gym.mail import Mailer
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

_READING = {"GET", "HEAD", "OPTIONS"}
Part = TypeVar("Part")


@runtime_checkable
class _Closable(Protocol):
    def close(self) -> None: ...


@dataclass(frozen=True)
class Services:
    """Settings, database, outgoing connections, and one object of each class that a feature needs
    for the life of the server.

    Parameters
    ----------
    parts : those objects by class.
    """

    settings: GymSettings
    database: Database
    mailer: Mailer
    store: FileStore
    parts: Mapping[type, Any] = field(default_factory=dict)

    def get(self, kind: type[Part]) -> Part:
        """Return the server's one object of a class."""
        part: Part = self.parts[kind]
        return part

    def close(self) -> None:
        """Wait for work in progress, and close the connections."""
        for part in self.parts.values():
            if isinstance(part, _Closable):
                part.close()
        self.database.close()


# Coroutines, though they await nothing: a function would be called in a thread of its own.
async def _services(request: Request) -> Services:
    services: Services = request.app.state.services
    return services


ServicesOf = Annotated[Services, Depends(_services)]


def is_reading(request: Request) -> bool:
    """Return whether the request's method changes nothing."""
    return request.method in _READING


async def _wait_for_slot(request: Request) -> AsyncIterator[None]:
    """Wait until few enough requests are in a transaction.

    A transaction is kept while its request waits for a thread: first for its rule, then for its
    endpoint. If as many as the pool has connections could begin one, others would wait for a
    connection in all of the threads, and none would get on.
    """
    async with request.app.state.transaction_slots:
        yield


def endpoint_session(
    request: Request,
    services: ServicesOf,
    _: Annotated[None, Depends(_wait_for_slot, scope="function")],
) -> Iterator[Session]:
    """Yield the one transaction of an endpoint and of its rule."""
    database = services.database
    with database.reading() if is_reading(request) else database.writing() as session:
        request.state.session = session
        yield session


# Ended when the endpoint returns: what was answered has been committed.
Db = Annotated[Session, Depends(endpoint_session, scope="function")]


@contextmanager
def rule_session(request: Request, services: Services) -> Iterator[Session]:
    """Yield the endpoint's transaction. A rule gets a short one of its own if its endpoint has no
    `Db`, because that endpoint opens transactions later, or several."""
    session: Session | None = getattr(request.state, "session", None)
    if session is not None:
        yield session
        return
    with services.database.reading() as session:
        yield session


def token_of(headers: Mapping[str, str]) -> str | None:
    """Return the token of a request; None: it has none, and its cookies count."""
    kind, _, secret = headers.get("authorization", "").partition(" ")
    return secret.strip() if kind.lower() == "bearer" else None


def network_of(request: Request) -> str:
    """Return the sender's address as the nearest trusted proxy reports it; for IPv6 the network of
    64 bits, because one household has all of them."""
    sender = request.client.host if request.client else ""
    try:
        address = ip_address(sender)
    except ValueError:
        return sender
    if isinstance(address, IPv6Address):
        return str(address.ipv4_mapped or ip_network((int(address) >> 64 << 64, 64)))
    return sender
