"""A published version gets suggested moves once, as a file of its own, or says that it failed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from uuid import UUID, uuid4

import msgspec
import pytest
from gym.tests.hurried import do_all, forget_jobs, waiting
from gym.tests.running import Process, wait_for
from gym.tests.test_gym_poison import aside
from gym.tests.worlds import Server, World, hold, make_world
from sqlalchemy import delete

from walltopo.scans import routes as found
from walltopo.scans.document import parse
from walltopo.scans.folder import ScanFolder
from walltopo.scans.moves import Moves
from walltopo_gym.jobs.queue import Task
from walltopo_gym.operating.purge import purge
from walltopo_gym.publishing.moves import SuggestedMoves, queue_missing, record_failure
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.queues import MOVES
from walltopo_gym.storage.files import FileStore

RUNGS = 7
# A ladder of jugs, and a hold alone.
LADDER = [
    msgspec.structs.replace(hold(n, 0.25 * (n % 2), 0.4 * n), type="jug") for n in range(1, RUNGS)
]
HOLDS = [*LADDER, hold(RUNGS, 3.0, 1.0)]
ROUTES = (
    found.Route(id=1, colour="red", holds=tuple(range(1, RUNGS)), start=(1,), top=(RUNGS - 1,)),
    found.Route(id=2, colour="blue", holds=(RUNGS,)),
)
ENTRIES = ({"number": 1, "name": "Ladder"}, {"number": 2, "name": "Alone"})


def task(server: Server, store: FileStore | None = None) -> Task:
    job = SuggestedMoves(server.database, store or server.services.store)
    return Task(MOVES, job.suggest, record_failure)


def reviewed(world: World, routes: Sequence[found.Route] = ROUTES) -> UUID:
    """Return a scan in review whose routes have starts and tops."""
    scan = world.reviewed({}, HOLDS)
    with TemporaryDirectory() as name:
        path = ScanFolder(Path(name)).routes
        found.Routes(routes=tuple(routes)).save(path)
        world.server.services.store.put(f"scans/{scan}/routes.json", path)
    return scan


@pytest.fixture
def world(server: Server) -> World:
    """A gym; no other one has anything to do."""
    forget_jobs(server)
    return make_world(server)


def moves_of(world: World, scan: object, who: str = "member") -> Any:
    """Return the file of a version, or the status of the refusal."""
    path = f"{world.path}/scans/{scan}/files/moves.json"
    answer = world.server.ask("GET", path, world.people[who])
    return answer.json() if answer.is_success else answer.status_code


@pytest.mark.slow
def test_a_version_gets_its_moves_after_its_publication(world: World) -> None:
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    path = f"{world.path}/walls/{world.wall.id}/published"
    before = world.server.ask("GET", path, world.people["member"])
    assert before.json()["moves"] == {"state": "waiting", "routes": []}
    assert moves_of(world, scan) == 404
    do_all(world.server, task(world.server))
    with_tag = {"if-none-match": before.headers["etag"]}
    after = world.server.ask("GET", path, world.people["member"], headers=with_tag).json()
    assert after["moves"] == {"state": "ready", "routes": [1]}
    reach = {row["number"]: row["reach"] for row in after["routes"]}
    assert {1.5, 1.65, 1.8} <= set(reach.pop(1))
    assert set(reach.values()) <= {None}  # no climbs
    assert {row["reach"] for row in before.json()["routes"]} == {None}
    ladder, alone = after["routes"]
    assert len(ladder["longest_reach"]) == len(ladder["reach"])
    assert all(0.4 < reach < 1.5 for reach in ladder["longest_reach"])
    assert ladder["height_m"] == pytest.approx(0.4 * (RUNGS - 2))
    assert (alone["longest_reach"], alone["height_m"]) == (None, 0.0)
    assert after["files"]["moves.json"].endswith(f"/scans/{scan}/files/moves.json")
    moves = parse(moves_of(world, scan), Moves, "the moves")
    (route,) = moves.routes
    bodies = [(climber.climber, climber.height, climber.span) for climber in route.climbers]
    assert bodies == [("short", 1.55, 1.55), ("adult", 1.75, 1.75), ("tall", 1.9, 1.9)]
    assert all(climber.reached for climber in route.climbers)
    assert route.grade is None


def test_moves_are_seen_by_those_who_see_the_wall(world: World) -> None:
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    do_all(world.server, task(world.server))
    seen = {who: moves_of(world, scan, who) for who in world.people}
    refused = {who for who, answer in seen.items() if answer == 404}
    assert refused == {"nobody", "stranger", "operator"}
    assert {type(answer) for who, answer in seen.items() if who not in refused} == {dict}


def test_each_version_has_its_own_moves(world: World) -> None:
    first = reviewed(world)
    assert world.publish(first, *ENTRIES).is_success
    do_all(world.server, task(world.server))
    server, setter = world.server, world.people["setter"]
    amend = f"{world.path}/walls/{world.wall.id}/amendments"
    second = server.ask("POST", amend, setter).json()["id"]
    assert moves_of(world, second, "setter") == 404  # not of the version that it amends
    shorter = msgspec.structs.replace(ROUTES[0], top=(RUNGS - 2,))
    with TemporaryDirectory() as name:
        path = ScanFolder(Path(name)).routes
        found.Routes(routes=(shorter,)).save(path)
        server.services.store.put(f"scans/{second}/routes.json", path)
    of_first = moves_of(world, first)
    assert world.publish(UUID(second), {"number": 1}, revision=1).is_success
    assert world.published()["moves"]["state"] == "waiting"
    do_all(server, task(server))
    assert world.published()["moves"] == {"state": "ready", "routes": [1]}
    assert moves_of(world, second)["made_for"] != of_first["made_for"]
    purge(server.settings, server.database, server.services.store)
    past = server.ask("GET", f"{world.path}/walls/{world.wall.id}/past/{first}", setter).json()
    assert past["moves"] == {"state": "ready", "routes": [1]}
    # Put back: the moves are there already.
    body = {"scan_id": str(first), "revision": 2}
    back = f"{world.path}/walls/{world.wall.id}/put-back"
    assert server.ask("POST", back, setter, body).is_success
    assert waiting(server, MOVES.name) == []
    assert moves_of(world, first) == of_first


def test_a_version_without_its_files_says_so(world: World) -> None:
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    world.server.services.store.drop([f"scans/{scan}/holds.json"])
    do_all(world.server, task(world.server))
    assert world.published()["moves"] == {"state": "failed", "routes": []}
    assert aside(world.server) == []  # another try would find the same


class Away(FileStore):
    """A store whose first fetches fail."""

    failures = 2
    calls = 0

    def fetch(self, key: str, path: Path) -> None:
        self.calls += 1
        if self.calls <= self.failures:
            raise OSError("the store is away")
        super().fetch(key, path)


def test_a_store_that_is_away_is_tried_again(world: World) -> None:
    server = world.server
    assert world.publish(reviewed(world), *ENTRIES).is_success
    away = Away(server.services.store.objects)
    do_all(server, task(server, away))
    assert away.calls == 4  # twice in vain, then two files
    assert world.published()["moves"]["state"] == "ready"
    away.failures = 1000
    assert world.publish(reviewed(world), *ENTRIES, revision=1).is_success
    do_all(server, task(server, away))
    assert world.published()["moves"]["state"] == "failed"
    assert len(aside(server)) == 1


def test_what_was_deleted_needs_no_moves(world: World) -> None:
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    with world.server.database.writing() as session:
        session.execute(delete(Scan).where(Scan.id == scan))
    do_all(world.server, task(world.server))
    task(world.server).run(str(uuid4()))
    assert aside(world.server) == []


@pytest.mark.slow
def test_a_starting_worker_queues_what_has_no_moves_once(world: World) -> None:
    server = world.server
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    forget_jobs(server)
    for _ in range(2):
        queue_missing(server.database)
    assert waiting(server, MOVES.name).count((str(scan),)) == 1
    do_all(server, task(server))
    assert world.published()["moves"]["state"] == "ready"
    forget_jobs(server)
    queue_missing(server.database)
    assert (str(scan),) not in waiting(server, MOVES.name)


@pytest.mark.slow
def test_another_worker_goes_on_when_one_is_killed(world: World) -> None:
    """The first one is killed while it computes."""
    server = world.server
    many = [msgspec.structs.replace(ROUTES[0], id=number) for number in range(1, 400)]
    scan = reviewed(world, many)
    assert world.publish(scan, *({"number": one.id} for one in many)).is_success
    settings = {"database": server.settings.database} if server.settings.database else {}

    def is_running() -> bool:
        rows = server.database.jobs.list_workflows(status="PENDING", name=MOVES.name)
        return any(row.input and row.input["args"][1:] == (str(scan),) for row in rows)

    worker = Process(server.settings.data, "worker", **settings)
    try:
        wait_for(is_running)
        worker.kill()
        assert world.published()["moves"]["state"] == "waiting"
        worker = Process(server.settings.data, "worker", **settings)
        wait_for(partial(_is_ready, world))
        assert len(world.published()["moves"]["routes"]) == len(many)
    finally:
        worker.stop()


def _is_ready(world: World) -> bool:
    return bool(world.published()["moves"]["state"] == "ready")


@pytest.mark.slow
def test_a_real_scan_gets_moves(server: Server, tiny_scan: Path) -> None:
    forget_jobs(server)
    world = make_world(server)
    scan = world.finished(tiny_scan)
    numbers = [route.id for route in found.Routes.load(ScanFolder(tiny_scan).routes).routes]
    assert world.publish(scan, *({"number": number} for number in numbers)).is_success
    do_all(server, task(server))
    version = world.published()
    assert version["moves"]["state"] == "ready"
    assert set(version["moves"]["routes"]) <= set(numbers)
    assert version["moves"]["routes"]


def test_a_route_is_described_in_words_once_its_moves_are_known(world: World) -> None:
    scan = reviewed(world)
    assert world.publish(scan, *ENTRIES).is_success
    ids = {row["number"]: row["id"] for row in world.published()["routes"]}

    def described(number: int = 1, query: str = "", who: str = "member") -> Any:
        path = f"{world.path}/routes/{ids[number]}/description{query}"
        return world.server.ask("GET", path, world.people[who])

    assert described().json()["code"] == "moves-not-ready"
    do_all(world.server, task(world.server))
    usual = described().json()
    assert (usual["scan_id"], usual["height_m"]) == (str(scan), 1.75)
    texts = [one["text"] for one in usual["sentences"]]
    assert texts[0].startswith("Ladder: 6 hand holds, ")
    assert texts[-1] == "Top: jug, 2.4 metres above the floor."
    assert usual["sentences"][-1]["hold"] == RUNGS - 1
    short = described(query="?height_cm=140&language=cs&unit=hands&detail=short").json()
    assert short["height_m"] == 1.55
    assert short["sentences"][-1]["text"] == "Top: madlo, 2,4 metru nad zemí."
    assert described(2).json()["code"] == "route-without-moves"
    assert described(query="?height_cm=20").status_code == 422
    assert described(who="stranger").status_code == 404
