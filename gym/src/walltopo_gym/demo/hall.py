"""The demo gym: two accounts, and walls scanned by the platform's own job; each made once.

Every step checks what exists already, so an interrupted demo continues.
"""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Callable, Mapping, Sequence
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
from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.passwords import Passwords
from walltopo_gym.accounts.people import add_person, find_person, set_password
from walltopo_gym.climbing.counting import recount_gym
from walltopo_gym.clock import now
from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.crowd.people import add_climbers, fill_own
from walltopo_gym.database.engine import Database
from walltopo_gym.demo.clip import DemoClip, send_clip
from walltopo_gym.demo.ropes import make_ropes
from walltopo_gym.events import publish_event
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.models import GradeSystem, Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.gyms.service import open_gym
from walltopo_gym.publishing.review import found_routes
from walltopo_gym.publishing.service import Entry, Placed, publish
from walltopo_gym.publishing.version_holds import VersionHolds, version_holds
from walltopo_gym.publishing.versions import gym_routes
from walltopo_gym.scans.incoming import Incoming
from walltopo_gym.scans.models import Photo, Scan, ScanProgress
from walltopo_gym.scans.receiving import finish_photo, photo_to_receive
from walltopo_gym.scans.service import State, create_version, request_run
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore, hash_of_file
from walltopo_gym.walls.models import Wall
from walltopo_gym.work import at_work

SLUG: Final = "demo"
_ACCOUNTS: Final = "demo-accounts.json"
NAME: Final = "Demo gym (made up)"
_WALLS: Final = ("Corner", "Harbour")
# Days since the routes of each wall were set, one after the other.
_SET: Final = ((69, 62), (33, 9))
_NAMES: Final = (
    "Moonshine",
    "Left Turn",
    "Cold Coffee",
    "The Plum",
    "Paperclip",
    "Slow Motion",
    "Half a Sandwich",
    "Sunday",
    "Old Friend",
    "Quiet Feet",
    "Night Bus",
    "Tin Roof",
    "Second Breakfast",
    "Salt",
    "Low Tide",
    "Postcard",
)
_EASIEST, _HARDEST = "4", "7A"
_SETTERS: Final = ("Demo setter", "Nadia", "Tomas")
_LOOK_S: Final = 0.5

Found = TypeVar("Found")


@dataclass(frozen=True)
class Hall:
    """The demo over a data folder.

    Parameters
    ----------
    tell : receives progress lines for the operator.
    """

    settings: GymSettings
    database: Database
    store: FileStore
    tell: Callable[[str], None]

    def make(self, folders: Sequence[Path], clip: DemoClip | None = None) -> dict[str, str]:
        """Create what is missing and return address to password of the two accounts.

        Parameters
        ----------
        folders : photos of a wall each. clip : of the demo climber, read once a worker runs.

        Raises
        ------
        InputError : a folder has no photos; StageError : a scan failed.
        """
        accounts = self._accounts()
        setter, climber = (self._person(f"{who}@{SLUG}.example") for who in ("setter", "climber"))
        walls = self._begun(setter, climber, len(folders))
        missing = {
            scan: folder
            for (wall, scan), folder in zip(walls, folders, strict=True)
            if wall.published_scan_id is None
        }
        if missing:
            with at_work(self.settings, self.database, self.store):
                for scan, folder in missing.items():
                    self._send(scan, folder)
                for scan in missing:
                    self._see_through(scan)
            self._publish([scan for _, scan in walls], set(missing))
        versions = self._versions([wall.id for wall, _ in walls])
        with self.database.writing() as session:
            gym = session.scalars(select(Gym).where(Gym.slug == SLUG)).one()
            routes = [route for route, _ in gym_routes(session, gym.id) if route.line_id is None]
            routes.sort(key=lambda route: (route.set_on, route.name))
            add_climbers(session, gym, routes, now())
            fill_own(session, gym, climber, routes, now())
            current = [session.get_one(Wall, wall.id) for wall, _ in walls]
            make_ropes(session, gym, climber, now())
            publish_event(session, DemoFilled(gym, setter, routes, current, versions, now()))
        recount_gym(self.database, gym.id)
        if clip is not None:
            send_clip(self.settings, self.database, self.store, (gym.id, climber), clip)
        return accounts

    def _versions(self, walls: Sequence[UUID]) -> dict[UUID, VersionHolds]:
        """Return the holds of the walls' published versions, by wall."""
        with self.database.reading() as session:
            published = {wall: session.get_one(Wall, wall).published_scan_id for wall in walls}
        return {
            wall: version_holds(self.store, scan)
            for wall, scan in published.items()
            if scan is not None
        }

    def _accounts(self) -> dict[str, str]:
        """Create the two accounts. Their passwords belong to this folder and are kept for the next
        start."""
        file = self.settings.data / _ACCOUNTS
        known: dict[str, str] = json.loads(file.read_text()) if file.is_file() else {}
        passwords = Passwords()
        made = {}
        for who in ("setter", "climber"):
            email = f"{who}@{SLUG}.example"
            password = made[email] = known.get(email) or secrets.token_urlsafe(9)
            kept = passwords.hash(password)
            with self.database.writing() as session:
                person = find_person(session, email)
                if person is None:
                    add_person(session, email, f"Demo {who}", kept)
                elif email not in known:
                    set_password(session, person, kept)
        with atomic_path(file) as temporary:
            temporary.touch(mode=0o600)
            temporary.write_text(json.dumps(made, indent=1))
        return made

    def _person(self, email: str) -> UUID:
        with self.database.reading() as session:
            person = find_person(session, email)
            assert person is not None
            return person.id

    def _begun(self, setter: UUID, climber: UUID, walls: int) -> list[tuple[Wall, UUID]]:
        """Return the walls, each with its scan, finished or running."""
        with self.database.writing() as session:
            gym = session.scalar(select(Gym).where(Gym.slug == SLUG))
            if gym is None:
                gym = open_gym(
                    session,
                    setter,
                    NAME,
                    SLUG,
                    visibility="public",
                    joining="open",
                    place="Walls scanned from rendered photos",
                )
                add_member(session, gym.id, climber, Role.MEMBER, setter)
            return [self._wall(session, gym, setter, number) for number in range(walls)]

    @staticmethod
    def _wall(session: Session, gym: Gym, setter: UUID, number: int) -> tuple[Wall, UUID]:
        name = _WALLS[number] if number < len(_WALLS) else f"Wall {number + 1}"
        here = select(Wall).where(Wall.gym_id == gym.id, Wall.name == name)
        wall = session.scalar(here)
        if wall is None:
            wall = Wall(gym_id=gym.id, name=name, place=number)
            session.add(wall)
            session.flush()
        scan = session.scalar(select(Scan).where(Scan.wall_id == wall.id))
        return wall, (scan or create_version(session, wall, setter)).id

    def _send(self, scan: UUID, photos: Path) -> None:
        """Queue the photos as an upload would."""
        files = sorted(f for f in photos.glob("*") if f.suffix.lower() in PHOTO_SUFFIXES)
        if not files:
            raise InputError(f"{photos}: no photos there", "Give the demo's photos by --photos.")
        incoming = Incoming(self.settings.data / "incoming", self.settings.keep_free_mb)
        for file in files:
            with self.database.writing() as session:
                photo, _ = photo_to_receive(
                    session,
                    scan,
                    file.name,
                    file.stat().st_size,
                    hash_of_file(file),
                    self.settings.max_photos,
                )
            if photo.state == "receiving":
                incoming.store_whole(photo.id, file)
                finish_photo(self.database, self.store, incoming, photo.id)

    def _see_through(self, scan: UUID) -> None:
        """Wait until the photos are checked, then until the scan is in review."""
        waiting = select(Photo.id).where(
            Photo.scan_id == scan, Photo.state.in_(("receiving", "received"))
        )
        while self._ask(lambda session: session.scalar(waiting.limit(1))) is not None:
            time.sleep(_LOOK_S)
        with self.database.writing() as session:
            row = session.get_one(Scan, scan)
            if row.state in (State.UPLOADING, State.FAILED, State.CANCELLED):
                request_run(session, row)
        shown = ""
        while (row := self._ask(lambda session: session.get_one(Scan, scan))).state != State.REVIEW:
            if row.state == State.FAILED:
                raise StageError(f"the demo's scan failed: {row.error}", row.hint)
            progress = self._ask(lambda session: session.get(ScanProgress, scan))
            if progress is not None and progress.stage != shown:
                shown = progress.stage
                self.tell(f"scanning: {shown}")
            time.sleep(_LOOK_S)

    def _ask(self, what: Callable[[Session], Found]) -> Found:
        with self.database.reading() as session:
            return what(session)

    def _publish(self, scans: Sequence[UUID], missing: set[UUID]) -> None:
        """Publish the missing scans as a setter would: each route gets a name and a grade."""
        found = {scan: found_routes(self.store, scan) for scan in scans}
        named = name_routes(list(found.values()))
        for index, (scan, facts) in enumerate(zip(scans, named, strict=True)):
            if scan not in missing:
                continue
            with self.database.writing() as session:
                row = session.get_one(Scan, scan)
                wall = session.get_one(Wall, row.wall_id)
                system = session.scalars(
                    select(GradeSystem).where(
                        GradeSystem.gym_id == wall.gym_id, GradeSystem.kind == "font"
                    )
                ).one()
                days = _SET[index % len(_SET)]
                entries = [
                    Entry(
                        number,
                        None,
                        {
                            **fields,
                            "grade_system_id": system.id,
                            "set_on": (now() - timedelta(days=days[turn % len(days)])).date(),
                        },
                    )
                    for turn, (number, fields) in enumerate(facts.items())
                ]
                known = {number: Placed.of(route) for number, route in found[scan].items()}
                publish(session, row, wall.revision, entries, known, now().date())


def name_routes(walls: Sequence[Mapping[int, FoundRoute]]) -> list[dict[int, dict[str, object]]]:
    """Return facts of each wall's routes by number: names from a list, grades by steepness and
    largest move, so that routes that look harder have harder grades.

    The grades do not claim how hard these routes are.
    """
    every = [(wall, route) for wall, found in enumerate(walls) for route in found.values()]
    every.sort(key=lambda each: each[1].steepness_deg / 10 + each[1].largest_move)
    scale = FONT[FONT.index(_EASIEST) : FONT.index(_HARDEST) + 1]
    named: list[dict[int, dict[str, object]]] = [{} for _ in walls]
    for index, (wall, route) in enumerate(every):
        turn, name = divmod(index, len(_NAMES))
        named[wall][route.id] = {
            "name": f"{_NAMES[name]} {turn + 1}" if turn else _NAMES[name],
            "grade": scale[round(index * (len(scale) - 1) / max(1, len(every) - 1))],
            "colour": route.colour,
            "setter": _SETTERS[index % len(_SETTERS)],
        }
    return named
