"""A server for tests, and a gym in it with somebody in each role."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import UUID, uuid4

import httpx
from anyio.from_thread import start_blocking_portal
from argon2 import PasswordHasher
from fastapi import FastAPI
from fastapi.testclient import TestClient
from sqlalchemy import create_engine, event, text

from walltopo.core.files import files_below
from walltopo.scans import routes as found
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.manifest import Manifest, StageRecord
from walltopo.scans.scale import Scale
from walltopo_gym.accounts.access import COOKIE
from walltopo_gym.accounts.actor import TOKEN_PREFIX, Scope, sign_in
from walltopo_gym.accounts.models import ApiToken, Person
from walltopo_gym.accounts.passwords import Passwords
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.api.services import Services
from walltopo_gym.clock import now
from walltopo_gym.editing.service import EditSessions
from walltopo_gym.features import features_on, open_database
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.gyms.service import open_gym
from walltopo_gym.mail import Mail
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.restoration import Restoration
from walltopo_gym.operating.setup import Setup
from walltopo_gym.scans.artifacts import store_public_files
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.scans.pictures import store_front
from walltopo_gym.scans.service import State
from walltopo_gym.server.app import PREFIX, build_app
from walltopo_gym.settings import load_settings
from walltopo_gym.storage.files import open_store
from walltopo_gym.walls.models import Wall

PASSWORD = "chalk bucket overhang 7"
ORIGIN = "https://walls.example.com"
_NUMBERS = itertools.count(1)


class Outbox:
    """Keeps the mails that would have been sent."""

    def __init__(self) -> None:
        self.mails: list[Mail] = []

    def send(self, mail: Mail) -> None:
        self.mails.append(mail)

    hand_over = send

    def secret_for(self, email: str) -> str:
        """The secret of the last link that was mailed there."""
        texts = [mail.text for mail in self.mails if mail.to == email]
        return next(word for word in texts[-1].split() if "#" in word).partition("#")[2]


@dataclass(frozen=True)
class Somebody:
    """A person who is signed in, or nobody."""

    id: UUID | None = None
    email: str = ""
    headers: dict[str, str] = field(default_factory=dict)


NOBODY = Somebody()


def _hurry(connection: Any, record: object) -> None:
    connection.execute("PRAGMA synchronous = OFF")


class Server:
    """The application over a database of its own.

    Parameters
    ----------
    folder : its data folder; url : of its database, empty for SQLite in the folder.
    """

    def __init__(self, folder: Path, url: str = "", **settings: object) -> None:
        given = {
            "data": folder,
            "address": ORIGIN,
            "new_gyms": "anyone",
            "database": url,
            "requests_per_minute": 0,
        }
        self.settings = load_settings(given | settings, {})
        self.database = open_database(self.settings)
        if self.database.is_sqlite:  # as fast as it gets; none of these tests cuts the power
            event.listen(self.database.engine, "connect", _hurry)
        migrate(self.database)
        self.outbox = Outbox()
        # Argon2's costs are the library's defaults in `Passwords()`; here they would be paid often.
        self.passwords = Passwords(PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))
        store = open_store(self.settings)
        self.incoming = Incoming(folder / "incoming", keep_free_mb=0)
        edit_sessions = EditSessions(folder / "editing", 1, self.database, store)
        parts = (
            self.passwords,
            self.incoming,
            edit_sessions,
            Restoration(),
            Setup(),
            *(p for feature in features_on(self.settings) for p in feature.parts(self.database)),
        )
        self.services = Services(
            self.settings, self.database, self.outbox, store, {type(part): part for part in parts}
        )
        self.app = build_app(self.services)
        # A client without a portal starts an event loop and threads for each request.
        self._loop = ExitStack()
        self.portal = self._loop.enter_context(start_blocking_portal())

    def client(self, app: FastAPI | None = None) -> TestClient:
        """A browser without a cookie; `app`: of another application over the same services."""
        client = TestClient(app or self.app, base_url=ORIGIN, raise_server_exceptions=False)
        client.portal = self.portal
        return client

    @contextmanager
    def replacing(self, part: object) -> Iterator[None]:
        """Serve with another object of its class for as long as the block lasts."""
        parts = {**self.services.parts, type(part): part}
        self.app.state.services = replace(self.services, parts=parts)
        try:
            yield
        finally:
            self.app.state.services = self.services

    def ask(
        self,
        method: str,
        path: str,
        who: Somebody = NOBODY,
        json: object = None,
        headers: dict[str, str] | None = None,
        content: bytes | None = None,
    ) -> httpx.Response:
        """One request of somebody."""
        request = httpx.Request(
            method,
            ORIGIN + PREFIX + path,
            json=json,
            headers={**who.headers, **(headers or {})},
            content=content,
        )
        return self.portal.call(self._send, request)

    async def _send(self, request: httpx.Request) -> httpx.Response:
        # Half the time of a browser of `client`, which crosses threads for each part of an answer.
        transport = httpx.ASGITransport(
            self.app, raise_app_exceptions=False, client=("testclient", 50000)
        )
        async with httpx.AsyncClient(transport=transport, trust_env=False) as browser:
            return await browser.send(request)

    def person(self, name: str = "somebody") -> Somebody:
        """A new person, signed in; an operator by that name."""
        return self.persons(name)[name]

    def persons(self, *names: str) -> dict[str, Somebody]:
        """Several at once."""
        kept = self.passwords.hash(PASSWORD)
        rows = [
            Person(
                id=uuid4(),
                email=f"{name}.{next(_NUMBERS)}@example.com",
                name=name,
                password_hash=kept,
                operator=name == "operator",
            )
            for name in names
        ]
        with self.database.writing() as session:
            session.add_all(rows)
            session.flush()
            secrets = [sign_in(session, row.id, "test", 30) for row in rows]
        return {
            row.name: Somebody(row.id, row.email, {"cookie": f"{COOKIE}={secret}"})
            for row, secret in zip(rows, secrets, strict=True)
        }

    def token(self, who: Somebody, *scopes: Scope) -> Somebody:
        """A program that acts for somebody."""
        secret, kept = new_secret(TOKEN_PREFIX)
        assert who.id is not None
        with self.database.writing() as session:
            row = ApiToken(
                person_id=who.id,
                name="t",
                token_hash=kept,
                scopes=list(scopes),
                expires_at=now() + timedelta(days=365),
            )
            session.add(row)
        return Somebody(who.id, who.email, {"authorization": f"Bearer {secret}"})

    def close(self) -> None:
        self._loop.close()
        self.services.close()


@dataclass(frozen=True)
class World:
    """A gym with a wall, and people by what they are to it."""

    server: Server
    gym: Gym
    wall: Wall
    people: dict[str, Somebody]

    @property
    def path(self) -> str:
        return f"/gyms/{self.gym.slug}"

    def scan(self, state: State = State.UPLOADING, *, usable: int = 0) -> UUID:
        """A new scan of the wall, with photos that nobody ever sent."""
        row = Scan(wall_id=self.wall.id, state=state)
        with self.server.database.writing() as session:
            session.add(row)
        for number in range(usable):
            self.photo(row.id, name=f"{number}.jpg", state="usable")
        return row.id

    def reviewed(
        self, routes: Mapping[int, Sequence[int]], holds: Sequence[Hold], **facts: Any
    ) -> UUID:
        """A scan that is in review: its routes by number, and its holds."""
        row = Scan(wall_id=self.wall.id, state=State.REVIEW, **facts)
        with self.server.database.writing() as session:
            session.add(row)
        store = self.server.services.store
        with TemporaryDirectory() as name:
            folder = ScanFolder(Path(name))
            made = (found.Route(id=n, colour="red", holds=tuple(h)) for n, h in routes.items())
            found.Routes(routes=tuple(made)).save(folder.routes)
            Holds(metric=True, holds=tuple(holds)).save(folder.holds)
            scale = Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True)
            scale.save(folder.scale)
            stages = {
                "sparse": StageRecord("done", metrics={"photos": 20, "registered": 20}),
                "classify": StageRecord("done", metrics={"holds": len(holds)}),
            }
            Manifest(1, "0", {}, [], stages).save(folder.manifest)
            for path in Path(name).iterdir():
                store.put(f"scans/{row.id}/{path.name}", path)
        store.put("content/abcd", b"<!doctype html>")
        files = {"index.html": {"key": "content/abcd", "size": 15, "type": "text/html"}}
        with self.server.database.writing() as session:
            session.get_one(Scan, row.id).files = files
        return row.id

    def finished(self, folder: Path, **facts: Any) -> UUID:
        """A real scan in review, as a worker leaves it.

        Parameters
        ----------
        folder : of the finished scan.
        """
        row = Scan(wall_id=self.wall.id, state=State.REVIEW, **facts)
        with self.server.database.writing() as session:
            session.add(row)
        scan = row.id
        store, made = self.server.services.store, ScanFolder(folder)
        for file in files_below(folder):
            store.put(f"scans/{scan}/{file.relative_to(folder).as_posix()}", file)
        store_front(store, scan, made)
        files = store_public_files(store, made)
        with self.server.database.writing() as session:
            session.get_one(Scan, scan).files = files
        return scan

    def publish(self, scan: UUID, *entries: dict[str, Any], revision: int = 0) -> httpx.Response:
        """Publish a scan as the setter."""
        body = {"revision": revision, "routes": list(entries)}
        path = f"{self.path}/scans/{scan}/publish"
        return self.server.ask("POST", path, self.people["setter"], body)

    def published(self) -> dict[str, Any]:
        """Return what everybody sees of the wall."""
        path = f"{self.path}/walls/{self.wall.id}/published"
        answer = self.server.ask("GET", path, self.people["member"])
        assert answer.status_code == 200, answer.text
        payload: dict[str, Any] = answer.json()
        return payload

    def photo(self, scan: UUID, **facts: Any) -> UUID:
        """A photo of a scan."""
        row = Photo(scan_id=scan, **{"name": "a.jpg", "size": 9, "state": "receiving"} | facts)
        with self.server.database.writing() as session:
            session.add(row)
        if row.state == "receiving":
            self.server.incoming.begin(row.id, row.size)
        return row.id

    @property
    def owner(self) -> Somebody:
        return self.people["owner"]


def hold(number: int, x: float, z: float, *, colour: str = "red", size: float = 0.1) -> Hold:
    """A hold on a vertical wall, at metres from its left foot."""
    return Hold(id=number, kind="hold", colour=colour, position=(x, 0.0, z), size=size)


def make_people(server: Server) -> dict[str, Somebody]:
    """One of each kind; to which gym they belong is `make_world`'s."""
    names = ("stranger", "member", "judge", "setter", "owner", "operator")
    return server.persons(*names) | {"nobody": NOBODY}


def make_world(
    server: Server, people: dict[str, Somebody] | None = None, visibility: str = "private"
) -> World:
    """A new gym with these people in it, and one wall."""
    people = people or make_people(server)
    number = next(_NUMBERS)
    with server.database.writing() as session:
        owner = people["owner"].id
        assert owner is not None
        gym = open_gym(session, owner, f"Gym {number}", visibility=visibility, joining="open")
        for role in (Role.MEMBER, Role.JUDGE, Role.SETTER):
            person = people[role].id
            assert person is not None
            add_member(session, gym.id, person, role, owner)
        wall = Wall(gym_id=gym.id, name="Cave")
        session.add(wall)
    return World(server, gym, wall, people)


def new_database(server: str) -> str:
    """URL of a new, empty PostgreSQL database.

    Parameters
    ----------
    server : user@host:port.
    """
    name = f"gym{next(_NUMBERS)}"
    url = f"postgresql+psycopg://{server}/"
    engine = create_engine(url + "postgres", isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        connection.execute(text(f"CREATE DATABASE {name}"))
    engine.dispose()
    return url + name
