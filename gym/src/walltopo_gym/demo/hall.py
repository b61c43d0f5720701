"""The demo gym: two accounts, one wall, a scan by the platform's own job; each made once.

Every step looks at what is there already: a demo that was interrupted goes on.
"""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Final, TypeVar
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError, StageError
from walltopo.core.files import atomic_path
from walltopo.reconstruct.ingest.sources import PHOTO_SUFFIXES
from walltopo.scans.routes import Route as FoundRoute
from walltopo_gym.accounts.passwords import Passwords
from walltopo_gym.accounts.people import add_person, find_person, set_password
from walltopo_gym.climbing.counting import recount
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.demo.aims import fill_aims
from walltopo_gym.demo.crowd import fill, fill_own
from walltopo_gym.demo.cups import hold_cups
from walltopo_gym.gyms.grades import FONT
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.models import GradeSystem, Gym, Wall
from walltopo_gym.gyms.opening import open_gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.change import Entry, Placed, publish
from walltopo_gym.publishing.models import Route
from walltopo_gym.publishing.review import found_routes
from walltopo_gym.scans.asking import begin, start
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.states import State
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file
from walltopo_gym.uploads.incoming import Incoming
from walltopo_gym.uploads.models import Photo
from walltopo_gym.uploads.receiving import announce, finish
from walltopo_gym.work import at_work

SLUG: Final = "demo"
_ACCOUNTS: Final = "demo-accounts.json"
_NAMES: Final = ("Moonshine", "Left Turn", "Cold Coffee", "The Plum", "Paperclip", "Slow Motion",
                 "Half a Sandwich", "Sunday", "Old Friend", "Quiet Feet")  # fmt: skip
_SETTERS: Final = ("Demo setter", "Nadia (made up)")
_LOOK_S: Final = 0.5

Found = TypeVar("Found")


@dataclass(frozen=True)
class Hall:
    """The demo over a data folder.

    Parameters
    ----------
    tell : is given a line for the operator now and then.
    """

    settings: GymSettings
    database: Database
    store: FileStore
    tell: Callable[[str], None]

    def make(self, photos: Path) -> dict[str, str]:
        """Make what is missing; address to password of the two accounts.

        Raises
        ------
        InputError : no photos there; StageError : the scan failed.
        """
        accounts = self._accounts()
        setter = self._person(f"setter@{SLUG}.example")
        wall, scan = self._begun(setter)
        if wall.published_scan_id is None:
            with at_work(self.settings, self.database, self.store):
                self._send(scan, photos)
                self._see_through(scan)
            self._publish(scan, wall.id)
        with self.database.writing() as session:
            gym = session.scalars(select(Gym).where(Gym.slug == SLUG)).one()
            hanging = select(Route).where(Route.wall_id == wall.id).order_by(Route.name)
            routes = session.scalars(hanging).all()
            fill(session, gym, routes, now())
            fill_own(session, gym, self._person(f"climber@{SLUG}.example"), routes, now())
            hold_cups(session, gym, setter, routes, now())
            recount(session, gym)
            fill_aims(session, gym, routes, now())
        return accounts

    def _accounts(self) -> dict[str, str]:
        """The two accounts; their passwords are this folder's own, and kept for the next start."""
        file = self.settings.data / _ACCOUNTS
        known: dict[str, str] = json.loads(file.read_text()) if file.is_file() else {}
        passwords = Passwords()
        told = {}
        for who in ("setter", "climber"):
            email = f"{who}@{SLUG}.example"
            password = told[email] = known.get(email) or secrets.token_urlsafe(9)
            with self.database.writing() as session:
                person = find_person(session, email)
                if person is None:
                    add_person(session, email, f"Demo {who}", passwords.hash(password))
                elif email not in known:
                    set_password(session, person, password, passwords)
        with atomic_path(file) as temporary:
            temporary.touch(mode=0o600)
            temporary.write_text(json.dumps(told, indent=1))
        return told

    def _person(self, email: str) -> UUID:
        with self.database.reading() as session:
            person = find_person(session, email)
            assert person is not None
            return person.id

    def _begun(self, setter: UUID) -> tuple[Wall, UUID]:
        """The wall, and the scan of it that is made or being made."""
        with self.database.writing() as session:
            gym = session.scalar(select(Gym).where(Gym.slug == SLUG))
            if gym is None:
                gym = open_gym(
                    session, setter, "Demo hall", SLUG, visibility="public", joining="open",
                    place="Photos are rendered; climbers and ascents are made up",
                )  # fmt: skip
                climber = self._person(f"climber@{SLUG}.example")
                add_member(session, gym.id, climber, Role.MEMBER, setter)
            wall = session.scalar(select(Wall).where(Wall.gym_id == gym.id))
            if wall is None:
                wall = Wall(gym_id=gym.id, name="Corner")
                session.add(wall)
                session.flush()
            scan = session.scalar(select(Scan).where(Scan.wall_id == wall.id))
            return wall, (scan or begin(session, wall, setter)).id

    def _send(self, scan: UUID, photos: Path) -> None:
        """Hand the photos in, as an upload would."""
        files = sorted(f for f in photos.glob("*") if f.suffix.lower() in PHOTO_SUFFIXES)
        if not files:
            raise InputError(f"{photos}: no photos there", "Give the demo's photos by --photos.")
        incoming = Incoming(self.settings.data / "incoming", self.settings.keep_free_mb)
        for file in files:
            with self.database.writing() as session:
                photo, _ = announce(
                    session, scan, file.name, file.stat().st_size, hash_of_file(file),
                    self.settings.most_photos,
                )  # fmt: skip
            if photo.state == "receiving":
                incoming.drop(photo.id)
                incoming.begin(photo.id, photo.size)
                with incoming.appending(photo.id, 0) as stream:
                    stream.write(file.read_bytes())
                finish(self.database, self.store, incoming, photo.id)

    def _see_through(self, scan: UUID) -> None:
        """Wait until the photos were looked at, then for the scan to come to its review."""
        waiting = select(Photo.id).where(
            Photo.scan_id == scan, Photo.state.in_(("receiving", "received"))
        )
        while self._ask(lambda session: session.scalar(waiting.limit(1))) is not None:
            time.sleep(_LOOK_S)
        with self.database.writing() as session:
            row = session.get_one(Scan, scan)
            if row.state in (State.UPLOADING, State.FAILED, State.CANCELLED):
                start(session, row)
        told = ""
        while (row := self._ask(lambda session: session.get_one(Scan, scan))).state != State.REVIEW:
            if row.state == State.FAILED:
                raise StageError(f"the demo's scan failed: {row.error}", row.hint)
            progress = self._ask(lambda session: session.get(ScanProgress, scan))
            if progress is not None and progress.stage != told:
                told = progress.stage
                self.tell(f"scanning: {told}")
            time.sleep(_LOOK_S)

    def _ask(self, what: Callable[[Session], Found]) -> Found:
        with self.database.reading() as session:
            return what(session)

    def _publish(self, scan: UUID, wall: UUID) -> None:
        """As a setter would: every route with a name and a grade."""
        found = found_routes(self.store, scan)
        with self.database.writing() as session:
            row, gym = session.get_one(Scan, scan), session.get_one(Wall, wall)
            system = session.scalars(
                select(GradeSystem).where(GradeSystem.gym_id == gym.gym_id)
            ).one()
            began = (now() - timedelta(days=42)).date()
            entries = [
                Entry(number, None, facts | {"grade_system_id": system.id})
                for number, facts in name_routes(found).items()
            ]
            known = {number: Placed.of(route) for number, route in found.items()}
            publish(session, row, gym.revision, entries, known, began)


def name_routes(found: dict[int, FoundRoute]) -> dict[int, dict[str, object]]:
    """Names from a list, grades by steepness and the largest move: harder to look at, harder to
    climb. They say nothing of how hard these routes are."""
    harder = sorted(found.values(), key=lambda r: r.steepness_deg / 10 + r.largest_move)
    first = FONT.index("5")
    return {
        route.id: {
            "name": _NAMES[place % len(_NAMES)],
            "grade": FONT[min(first + 2 * place, len(FONT) - 1)],
            "colour": route.colour,
            "setter": _SETTERS[place % len(_SETTERS)],
        }
        for place, route in enumerate(harder)
    }
