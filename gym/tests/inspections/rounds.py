"""A gym whose walls are inspected, and requests of its staff."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from typing import Any
from uuid import UUID, uuid4

from gym.tests.worlds import World, hold
from PIL import Image

from walltopo_gym.walls.models import Wall


def photo(size: tuple[int, int] = (64, 48), *, place: bool = False) -> bytes:
    """A JPEG; with `place`, its metadata has a note and the place of the photo."""
    out = BytesIO()
    exif = Image.Exif()
    if place:
        exif[0x010E] = "a note of the phone"
        exif.get_ifd(0x8825)[1] = "N"
    Image.new("RGB", size, (90, 140, 60)).save(out, "JPEG", exif=exif, comment=b"a comment")
    return out.getvalue()


@dataclass(frozen=True)
class InspectionOf:
    """An inspection of a world's wall."""

    world: World
    id: str
    checklist: list[str]

    @property
    def path(self) -> str:
        return f"{self.world.path}/inspections/{self.id}"

    def ask(self, method: str, part: str = "", body: object = None, who: str = "setter") -> Any:
        return self.world.server.ask(method, self.path + part, self.world.people[who], body)

    def mark(self, who: str = "setter", *, key: UUID | None = None, **facts: Any) -> Any:
        """Mark the first item, or what `facts` say."""
        body = {"wall_id": str(self.world.wall.id), "mark": "fine"} | facts
        if "hold" not in body:
            body = {"item": 0} | body
        return self.ask("PUT", f"/entries/{key or uuid4()}", body, who)

    def send_photo(self, content: bytes, who: str = "setter") -> Any:
        people = self.world.people
        return self.world.server.ask("POST", f"{self.path}/photos", people[who], content=content)

    def finish(self, result: str = "passed", who: str = "setter", **facts: Any) -> Any:
        return self.ask("POST", "/finish", {"result": result} | facts, who)

    def read(self) -> Any:
        answer = self.ask("GET")
        assert answer.status_code == 200, answer.text
        return answer.json()


def publish_holds(world: World) -> UUID:
    """Publish a version of the wall: hold 1 on the route Moon, hold 2 without a route."""
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0), hold(2, 1.0, 1.0, colour="blue")])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    return scan


def begin(world: World, level: str = "visual", who: str = "setter", **facts: Any) -> InspectionOf:
    """Begin an inspection of the wall."""
    body = {"level": level, "walls": [str(world.wall.id)]} | facts
    answer = world.server.ask("POST", f"{world.path}/inspections", world.people[who], body)
    assert answer.status_code == 201, answer.text
    return InspectionOf(world, answer.json()["id"], answer.json()["checklist"])


def add_wall(world: World, name: str) -> str:
    row = Wall(gym_id=world.gym.id, name=name)
    with world.server.database.writing() as session:
        session.add(row)
    return str(row.id)


def save_plan(world: World, **days: int | None) -> None:
    """Save the plan with other intervals of some levels."""
    path = f"{world.path}/inspections/plan"
    levels = world.server.ask("GET", path, world.owner).json()["levels"]
    for level in levels:
        level["interval_days"] = days.get(level["level"], level["interval_days"])
    assert world.server.ask("PUT", path, world.owner, {"levels": levels}).is_success
