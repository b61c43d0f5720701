"""One bad item of a background job fails alone, a bounded number of times, and says why."""

from __future__ import annotations

import logging
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NoReturn
from uuid import UUID, uuid4

import pytest
from dbos import DBOS
from gym.tests.hall.test_gym_telling import EVERYTHING, Service
from gym.tests.uploads.test_gym_uploads import jpeg
from gym.tests.webhooks.test_gym_webhooks import listener
from gym.tests.worlds import Server, World, hold, make_world
from sqlalchemy import delete, select, update

from walltopo.reconstruct.ingest.decoding import decode_files
from walltopo_gym.attempts import bounded
from walltopo_gym.attempts.bounded import MAX_TRIES
from walltopo_gym.attempts.models import JobAttempt
from walltopo_gym.clock import now
from walltopo_gym.grading import placing as placing_room
from walltopo_gym.grading.models import ScanPlaces
from walltopo_gym.grading.placing import Placing
from walltopo_gym.gyms.models import Gym
from walltopo_gym.hall import telling as telling_room
from walltopo_gym.hall.models import Message, PushAddress, Wishes
from walltopo_gym.hall.occasions import DIGEST, note_all
from walltopo_gym.hall.telling import Telling
from walltopo_gym.mail import Letter
from walltopo_gym.operating.jobs import jobs
from walltopo_gym.operating.purge import purge
from walltopo_gym.publishing.models import Plan
from walltopo_gym.publishing.plans import publish_due
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.states import State
from walltopo_gym.scans.worker import begin_queued, do_chores
from walltopo_gym.storage.files import FileStore
from walltopo_gym.uploads import looking as looking_room
from walltopo_gym.uploads.looking import look_at_some
from walltopo_gym.uploads.models import Photo, PhotoOverlap
from walltopo_gym.uploads.overlap import Overlaps, ask
from walltopo_gym.uploads.receiving import finish_all
from walltopo_gym.webhooks import delivery as delivery_room
from walltopo_gym.webhooks.delivery import Delivery
from walltopo_gym.webhooks.models import Webhook, WebhookEvent


class Clock:
    """The time of the background jobs, which a test moves on."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.ahead = timedelta()
        for room in (bounded, looking_room, delivery_room, telling_room):
            monkeypatch.setattr(room, "now", self.now)

    def now(self) -> datetime:
        return datetime.now(UTC) + self.ahead

    def pass_all_waits(self, work: Callable[[], int]) -> None:
        """Do the work as often as any item is tried, each time after the longest wait."""
        for _ in range(MAX_TRIES + 4):
            while work():
                pass
            self.ahead += timedelta(days=1)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


@pytest.fixture
def worlds(server: Server) -> tuple[World, World]:
    """Two gyms: the one with the bad item, and another one. No other gym has anything to do."""
    with server.database.writing() as session:
        for kind in (PhotoOverlap, Message, PushAddress, Wishes, WebhookEvent, Plan, JobAttempt):
            session.execute(delete(kind))
        session.execute(delete(Photo).where(Photo.state == "received"))
    return make_world(server), make_world(server)


def refuse(*_: object, **__: object) -> NoReturn:
    raise RuntimeError("poison")


def aside(server: Server) -> list[str]:
    """What the operator reads about background jobs that were given up."""
    with server.database.reading() as session:
        return [line for line in jobs(session) if "set aside" in line]


def photos_of(world: World) -> dict[str, str]:
    with world.server.database.reading() as session:
        ours = select(Photo).join(Scan).where(Scan.wall_id == world.wall.id)
        return {photo.name: photo.state for photo in session.scalars(ours)}


def test_a_photo_that_cannot_be_looked_at_is_set_aside(
    worlds: tuple[World, World], clock: Clock
) -> None:
    bad, good = worlds
    server, store = bad.server, bad.server.services.store
    store.put("originals/poison", jpeg(31))
    scan = bad.scan()
    for name in ("", "no suffix"):
        bad.photo(scan, state="received", sha256="poison", name=name)
    bad.photo(scan, state="received", sha256="never-stored", name="gone.jpg")
    for number in range(20):  # more than are looked at together
        bad.photo(scan, state="received", sha256=f"never-{number}", name=f"{number}.jpg")
    store.put("originals/fine", jpeg(32))
    good.photo(good.scan(), state="received", sha256="fine", name="fine.jpg")
    look_at_some(server.database, store)
    assert photos_of(good) == {"fine.jpg": "usable"}
    assert set(photos_of(bad).values()) == {"received"}  # its store may be away for a while
    clock.pass_all_waits(lambda: look_at_some(server.database, store))
    assert set(photos_of(bad).values()) == {"unusable"}
    told = server.ask("GET", f"{bad.path}/scans/{scan}/photos", bad.people["setter"]).json()
    assert all("could not be checked" in photo["reason"] for photo in told)
    assert look_at_some(server.database, store) == 0


def test_a_batch_that_fails_is_looked_at_one_by_one(
    worlds: tuple[World, World], monkeypatch: pytest.MonkeyPatch
) -> None:
    bad, good = worlds
    store = bad.server.services.store

    def die(files: list[tuple[int, Path]], *words: Any) -> Any:
        if any(path.read_bytes() == b"poison" for _, path in files):
            refuse()
        return decode_files(files, *words)

    monkeypatch.setattr("walltopo_gym.uploads.looking.decode_files", die)
    store.put("originals/poison", b"poison")
    store.put("originals/fine", jpeg(33))
    bad.photo(bad.scan(), state="received", sha256="poison", name="poison.jpg")
    good.photo(good.scan(), state="received", sha256="fine", name="fine.jpg")
    look_at_some(bad.server.database, store)
    assert (photos_of(bad), photos_of(good)) == (
        {"poison.jpg": "received"}, {"fine.jpg": "usable"}
    )  # fmt: skip


def test_photos_that_cannot_be_compared_are_set_aside(
    worlds: tuple[World, World], clock: Clock
) -> None:
    bad, good = worlds
    server, store = bad.server, bad.server.services.store
    broken = []
    for _ in range(25):
        broken.append(bad.scan())
        bad.photo(broken[-1], state="usable", sha256="no-thumbnail")
    fine = good.scan()
    with server.database.writing() as session:
        for scan in (*broken, fine):
            ask(session, scan)
    overlaps = Overlaps(server.database, store)

    def work() -> int:
        claimed = overlaps.claim()
        for scan, number, _ in claimed:
            overlaps.try_once(scan, number)
        return len(claimed)

    while work():
        pass
    path = f"{good.path}/scans/{fine}/overlap"
    assert server.ask("GET", path, good.people["setter"]).json()["pending"] is False
    clock.pass_all_waits(work)
    assert overlaps.claim() == []
    assert len(aside(server)) == 25
    told = server.ask("GET", f"{bad.path}/scans/{broken[0]}/overlap", bad.people["setter"]).json()
    assert told == {"pending": False, "groups": []}
    with server.database.writing() as session:
        ask(session, broken[0])  # other photos: it is tried again
    assert [claimed[0] for claimed in overlaps.claim()] == [broken[0]]


@pytest.mark.slow
def test_a_wall_that_cannot_be_placed_is_set_aside(
    worlds: tuple[World, World], clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad, good = worlds
    server = bad.server
    fine = good.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    broken = bad.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])  # the newest is placed first
    placing = Placing(server.database, server.services.store)
    place = placing.place
    monkeypatch.setattr(placing, "place", lambda s: refuse() if s == broken else place(s))
    tried: list[UUID] = []

    def work() -> int:
        claimed = placing.claim()
        for scan, _ in claimed:
            tried.append(scan)
            placing.try_once(scan)
        return len(claimed)

    clock.pass_all_waits(work)
    with server.database.reading() as session:
        assert session.get(ScanPlaces, fine) is not None
    assert tried.count(broken) == MAX_TRIES
    assert any(str(broken) in line and "poison" in line for line in aside(server))
    assert placing_room.QUEUE == "places"


def planned(world: World, entries: list[dict[str, Any]]) -> UUID:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    with world.server.database.writing() as session:
        session.add(Plan(scan_id=scan, at=now(), entries=entries, found={}))
    return scan


def test_a_planned_publication_that_fails_is_set_aside(
    worlds: tuple[World, World], clock: Clock
) -> None:
    bad, good = worlds
    broken = planned(bad, [{"no": "entry"}])
    fine = planned(good, [])
    server = bad.server
    publish_due(server.database)
    with server.database.reading() as session:
        assert session.get_one(Scan, fine).state == State.PUBLISHED
    clock.pass_all_waits(lambda: publish_due(server.database))
    with server.database.reading() as session:
        plan = session.get_one(Plan, broken)
        assert session.get_one(Scan, broken).state == State.REVIEW
        assert "could not be published" in plan.error
        assert "KeyError" not in plan.error  # the gym reads it


@pytest.mark.parametrize("poison", [{"secret": "whsec_A"}, {"url": f"https://{'a' * 64}.example/"}])
def test_a_webhook_that_fails_is_set_aside(
    worlds: tuple[World, World], clock: Clock, poison: dict[str, str]
) -> None:
    bad, good = worlds
    server = bad.server
    settings = server.settings.model_copy(update={"webhooks_to_private": True})
    delivery = Delivery(settings, server.database)
    with listener() as (url, told):
        with server.database.writing() as session:
            rows = [
                Webhook(gym_id=world.gym.id, url=url, secret="whsec_AAAA")
                for world in (bad, good)
            ]  # fmt: skip
            session.add_all(rows)
            session.flush()
            for name, value in poison.items():
                setattr(rows[0], name, value)
            session.add_all(WebhookEvent(webhook_id=row.id, body={"type": "t"}) for row in rows)

        def work() -> int:
            claimed = delivery.claim()
            for event, _ in claimed:
                delivery.try_once(event)
            return len(claimed)

        clock.pass_all_waits(work)
    assert len(told) == 1
    (facts,) = server.ask("GET", f"{bad.path}/webhooks", bad.owner).json()
    assert facts["waiting"] == 0
    assert facts["error"]
    assert facts["deliveries"][0]["error"] == facts["error"]
    (fine,) = server.ask("GET", f"{good.path}/webhooks", good.owner).json()
    assert (fine["waiting"], fine["error"], fine["deliveries"]) == (0, "", [])


def message(world: World, kind: str, target: str, **body: object) -> Message:
    person = world.people["member"].id
    assert person is not None
    return Message(
        person_id=person, gym_id=world.gym.id, kind=kind, subject=str(uuid4()), target=target,
        body=body, next_at=now(), tries=0, error="",
    )  # fmt: skip


def wish(world: World) -> None:
    """The member wants everything, at any hour."""
    answer = world.server.ask("PUT", "/me/messages", world.people["member"], EVERYTHING)
    assert answer.is_success


def test_a_mail_that_cannot_be_sent_is_set_aside(
    worlds: tuple[World, World], clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad, good = worlds
    server = bad.server
    send, poisoned = server.outbox.hand_over, bad.people["member"].email

    def hand_over(letter: Letter) -> None:
        if letter.to == poisoned:
            raise ValueError("Header values may not contain linefeed")
        send(letter)

    monkeypatch.setattr(server.outbox, "hand_over", hand_over)
    words: dict[str, object] = {"subject": "News", "lines": []}
    for world in worlds:
        wish(world)
        with server.database.writing() as session:
            session.add(message(world, DIGEST, "mail", **words))
    _tell_all(server, clock)
    letters = [letter.to for letter in server.outbox.letters if letter.subject == "News"]
    assert letters == [good.people["member"].email]
    _is_given_up(bad, "linefeed")


def test_a_push_that_cannot_be_sent_is_set_aside(worlds: tuple[World, World], clock: Clock) -> None:
    bad = worlds[0]
    server, service = bad.server, Service()
    shown = {"title": "t", "text": "x", "path": "/", "tag": "t"}
    try:
        for world in worlds:
            wish(world)
            person = world.people["member"].id
            row = PushAddress(person_id=person, **service.subscription())
            with server.database.writing() as session:
                if world is bad:
                    row.public_key = "no-key"
                session.add(row)
                session.flush()
                session.add(message(world, "fresh", str(row.id), **shown))
        with server.database.writing() as session:
            session.add(message(bad, "fresh", "no id of an address", **shown))
        _tell_all(server, clock)
        assert len(service.got) == 1
    finally:
        service.close()
    _is_given_up(bad, "")


def test_a_gym_whose_news_cannot_be_found_delays_no_other(
    worlds: tuple[World, World], clock: Clock
) -> None:
    bad, good = worlds
    server = bad.server
    for world in worlds:
        wish(world)
        with server.database.writing() as session:
            session.add(message(world, "fresh", str(uuid4()), title="t"))
    with server.database.writing() as session:
        row = update(Gym).where(Gym.id == bad.gym.id)
        session.execute(row.values(time_zone="Nowhere/Else"))
    note_all(server.database)
    _tell_all(server, clock)
    with server.database.reading() as session:
        rows = {row.gym_id: row for row in session.scalars(select(Message))}
    assert rows[good.gym.id].error == ""
    assert rows[good.gym.id].sent_at is not None
    _is_given_up(bad, "Nowhere")


def _tell_all(server: Server, clock: Clock) -> None:
    settings = server.settings.model_copy(update={"webhooks_to_private": True})
    worker = Telling(settings, server.database, server.outbox)

    def work() -> int:
        claimed = worker.claim()
        for row, _ in claimed:
            worker.try_once(row)
        return len(claimed)

    clock.pass_all_waits(work)
    assert worker.claim() == []


def _is_given_up(world: World, why: str) -> None:
    """The row stays, is tried no more, and says why."""
    with world.server.database.reading() as session:
        rows = session.scalars(select(Message).where(Message.gym_id == world.gym.id)).all()
    assert rows
    for row in rows:
        assert row.error
        assert why in row.error
        assert row.sent_at is not None


def test_a_scan_that_cannot_be_queued_delays_no_other(
    worlds: tuple[World, World], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = worlds[0].server
    scans = [str(world.scan(State.QUEUED)) for world in worlds]
    begun: list[str] = []

    def enqueue(queue: str, workflow: object, scan: str, run: int) -> None:
        if scan == scans[0]:
            refuse()
        begun.append(scan)

    monkeypatch.setattr(DBOS, "enqueue_workflow", enqueue)
    begin_queued(server.database, set())
    assert scans[1] in begun


def test_a_chore_that_fails_keeps_no_other_from_its_work(
    caplog: pytest.LogCaptureFixture,
) -> None:
    done: list[str] = []
    with caplog.at_level(logging.ERROR):
        do_chores((refuse, lambda: done.append("second")))
    assert done == ["second"]
    assert "poison" in caplog.text


def test_a_file_that_cannot_be_deleted_keeps_no_other_from_its_end(
    worlds: tuple[World, World], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = worlds[0].server
    store = server.services.store
    old = now() - timedelta(days=3)
    keys = [f"originals/poison-{uuid4()}", f"originals/other-{uuid4()}"]
    entries = [(key, 1, old) for key in keys]
    dropped: list[str] = []

    def drop(self: FileStore, gone: list[str]) -> None:
        if gone[0] == keys[0]:
            raise OSError("poison")
        dropped.extend(gone)

    monkeypatch.setattr(FileStore, "entries", lambda *_: iter(entries))
    monkeypatch.setattr(FileStore, "drop", drop)
    folder = server.settings.data / "incoming"
    (folder / "0-a-folder").mkdir()
    (folder / "stray.txt").write_text("no photo's")
    done = purge(server.settings, server.database, store)
    assert dropped == keys[1:] == done.files
    assert [name for name, _ in done.failed] == [keys[0], str(folder / "0-a-folder")]
    assert not (folder / "stray.txt").exists()
    (folder / "0-a-folder").rmdir()


def test_a_server_starts_whatever_lies_among_the_unfinished_photos(
    worlds: tuple[World, World], monkeypatch: pytest.MonkeyPatch
) -> None:
    bad, good = worlds
    server = bad.server
    services = server.services
    (server.settings.data / "incoming" / "notes.txt").write_text("no photo's")
    photos = []
    for world in worlds:
        photos.append(world.photo(world.scan(), size=4))
        with services.incoming.appending(photos[-1], 0) as stream:
            stream.write(b"poi1" if world is bad else b"good")
    put = FileStore.put

    def put_most(self: FileStore, key: str, source: Path | bytes) -> None:
        if source == services.incoming.path(photos[0]):
            raise OSError("poison")
        put(self, key, source)

    monkeypatch.setattr(FileStore, "put", put_most)
    finish_all(server.database, services.store, services.incoming)
    assert photos_of(good) == {"a.jpg": "received"}
    assert photos_of(bad) == {"a.jpg": "receiving"}
    (server.settings.data / "incoming" / "notes.txt").unlink(missing_ok=True)
