"""One bad item of a background job fails alone, a bounded number of times, and says why."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path
from typing import Any, NoReturn
from uuid import UUID, uuid4

import pytest
from gym.tests.hurried import do_all, forget_jobs, waiting
from gym.tests.notifications.test_gym_notifications import EVERYTHING, Service
from gym.tests.scans.test_gym_uploads import jpeg
from gym.tests.webhooks.test_gym_webhooks import delivery, listener
from gym.tests.worlds import Server, World, hold, make_world
from sqlalchemy import delete, select, update

from walltopo.reconstruct.ingest.decoding import decode_files
from walltopo_gym.clock import now
from walltopo_gym.grading.models import ScanPlaces
from walltopo_gym.grading.placing import PLACES, Placing, queue_missing
from walltopo_gym.gyms.models import Gym
from walltopo_gym.jobs.queue import Task, enqueue
from walltopo_gym.mail import Mail
from walltopo_gym.notifications.due import store_due_messages
from walltopo_gym.notifications.messages import DIGEST, MAILS, PUSHES
from walltopo_gym.notifications.models import Message, NotificationPreferences, PushAddress
from walltopo_gym.notifications.sending import MessageSender, record_failure
from walltopo_gym.operating.jobs import job_lines
from walltopo_gym.operating.purge import purge
from walltopo_gym.publishing import plans
from walltopo_gym.publishing.models import Plan
from walltopo_gym.publishing.plans import publish_due
from walltopo_gym.scans import overlap, photo_checks
from walltopo_gym.scans.models import Photo, PhotoOverlap, Scan
from walltopo_gym.scans.overlap import Overlaps
from walltopo_gym.scans.photo_checks import PhotoChecks
from walltopo_gym.scans.queues import (
    BATCHES,
    OVERLAPS,
    PHOTOS,
    photos_changed,
    queue_batch,
    routes_changed,
)
from walltopo_gym.scans.receiving import finish_all
from walltopo_gym.scans.service import State
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.zones import PUBLICATIONS, queue_publications
from walltopo_gym.webhooks.models import Webhook, WebhookEvent
from walltopo_gym.webhooks.service import DELIVERY, queue_webhook_message


@pytest.fixture
def worlds(server: Server) -> tuple[World, World]:
    """Two gyms: the one with the bad item, and another one. No other gym has anything to do."""
    forget_jobs(server)
    with server.database.writing() as session:
        for kind in (
            PhotoOverlap,
            Message,
            PushAddress,
            NotificationPreferences,
            WebhookEvent,
            Plan,
        ):
            session.execute(delete(kind))
        session.execute(delete(Photo).where(Photo.state == "received"))
    return make_world(server), make_world(server)


def refuse(*_: object, **__: object) -> NoReturn:
    raise RuntimeError("poison")


def photo_tasks(server: Server) -> tuple[Task, Task]:
    """Return the tasks that check photos, together and alone."""
    checks = PhotoChecks(server.database, server.services.store)
    alone = Task(PHOTOS, checks.check, photo_checks.record_failure)
    return Task(BATCHES, checks.check_batch), alone


def aside(server: Server) -> list[str]:
    """Return what the operator reads about background jobs that were given up."""
    return [line for line in job_lines(server.database) if "set aside" in line]


def photos_of(world: World) -> dict[str, str]:
    with world.server.database.reading() as session:
        ours = select(Photo).join(Scan).where(Scan.wall_id == world.wall.id)
        return {photo.name: photo.state for photo in session.scalars(ours)}


@pytest.mark.slow
def test_a_photo_that_cannot_be_looked_at_is_set_aside(worlds: tuple[World, World]) -> None:
    bad, good = worlds
    server, store = bad.server, bad.server.services.store
    store.put("originals/poison", jpeg(31))
    scans = (bad.scan(), good.scan())
    for name in ("", "no suffix"):
        bad.photo(scans[0], state="received", sha256="poison", name=name)
    bad.photo(scans[0], state="received", sha256="never-stored", name="gone.jpg")
    for number in range(14):  # more than are looked at together
        bad.photo(scans[0], state="received", sha256=f"never-{number}", name=f"{number}.jpg")
    store.put("originals/fine", jpeg(32))
    good.photo(scans[1], state="received", sha256="fine", name="fine.jpg")
    with server.database.writing() as session:
        for scan in scans:
            queue_batch(session, scan)
    batches, alone = photo_tasks(server)
    do_all(server, batches)
    assert photos_of(good) == {"fine.jpg": "usable"}
    assert set(photos_of(bad).values()) == {"received"}  # its store may be away for a while
    do_all(server, alone)
    assert set(photos_of(bad).values()) == {"unusable"}
    path = f"{bad.path}/scans/{scans[0]}/photos"
    payload = server.ask("GET", path, bad.people["setter"]).json()
    assert all("could not be checked" in photo["reason"] for photo in payload)
    assert len(aside(server)) == 17


def test_a_batch_that_fails_is_looked_at_one_by_one(
    worlds: tuple[World, World], monkeypatch: pytest.MonkeyPatch
) -> None:
    world = worlds[0]
    server, store = world.server, world.server.services.store
    together: list[int] = []

    def die(files: list[tuple[int, Path]], *words: Any) -> Any:
        together.append(len(files))
        if any(path.read_bytes() == b"poison" for _, path in files):
            refuse()
        return decode_files(files, *words)

    monkeypatch.setattr("walltopo_gym.scans.photo_checks.decode_files", die)
    store.put("originals/poison", b"poison")
    store.put("originals/fine", jpeg(33))
    scan = world.scan()
    for name in ("poison", "fine"):
        world.photo(scan, state="received", sha256=name, name=f"{name}.jpg")
    with server.database.writing() as session:
        queue_batch(session, scan)
    do_all(server, *photo_tasks(server))
    assert photos_of(world) == {"poison.jpg": "unusable", "fine.jpg": "usable"}
    assert sorted(together) == [1] * (PHOTOS.max_tries + 1) + [2]


def test_a_batch_whose_worker_was_killed_is_looked_at_one_by_one(
    worlds: tuple[World, World],
) -> None:
    world = worlds[0]
    server, store = world.server, world.server.services.store
    store.put("originals/fine", jpeg(34))
    scan = world.scan()
    world.photo(scan, state="received", sha256="fine", name="fine.jpg", batch=0)
    batches, alone = photo_tasks(server)
    batches.run(str(scan), 0)  # once more: it was begun before
    assert photos_of(world) == {"fine.jpg": "received"}
    assert len(waiting(server, PHOTOS.name)) == 1
    do_all(server, alone)
    assert photos_of(world) == {"fine.jpg": "usable"}


@pytest.mark.slow
def test_photos_that_cannot_be_compared_are_set_aside(worlds: tuple[World, World]) -> None:
    bad, good = worlds
    server, store = bad.server, bad.server.services.store
    broken = []
    for _ in range(9):
        broken.append(bad.scan())
        bad.photo(broken[-1], state="usable", sha256="no-thumbnail")
    fine = good.scan()
    with server.database.writing() as session:
        for scan in (*broken, fine):
            photos_changed(session, scan)
    task = Task(OVERLAPS, Overlaps(server.database, store).answer, overlap.record_failure)
    do_all(server, task)
    path = f"{good.path}/scans/{fine}/overlap"
    assert server.ask("GET", path, good.people["setter"]).json()["pending"] is False
    assert len(aside(server)) == 9
    payload = server.ask(
        "GET", f"{bad.path}/scans/{broken[0]}/overlap", bad.people["setter"]
    ).json()
    assert payload == {"pending": False, "groups": [], "shifts": [], "gaps": []}
    with server.database.writing() as session:
        photos_changed(session, broken[0])  # other photos: it is tried again
    assert waiting(server, OVERLAPS.name) == [(str(broken[0]), 2)]


@pytest.mark.slow
def test_a_wall_that_cannot_be_placed_is_set_aside(worlds: tuple[World, World]) -> None:
    bad, good = worlds
    server = bad.server
    fine = good.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    broken = bad.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    for _ in range(2):  # two workers start
        queue_missing(server.database)
    queued = waiting(server, PLACES.name)
    assert [queued.count((str(scan),)) for scan in (fine, broken)] == [1, 1]
    forget_jobs(server)
    with server.database.writing() as session:
        for scan in (broken, fine):
            routes_changed(session, scan)
    placing = Placing(server.database, server.services.store)
    tried: list[str] = []

    def place(scan: str) -> None:
        tried.append(scan)
        if scan == str(broken):
            refuse()
        placing.place(scan)

    do_all(server, Task(PLACES, place))
    with server.database.reading() as session:
        assert session.get(ScanPlaces, fine) is not None
    assert tried.count(str(broken)) == PLACES.max_tries
    assert any(str(broken) in line and "poison" in line for line in aside(server))


def planned(world: World, entries: list[dict[str, Any]]) -> UUID:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    with world.server.database.writing() as session:
        session.add(Plan(scan_id=scan, at=now(), entries=entries, found={}))
        queue_publications(session, world.gym.id)
    return scan


@pytest.mark.slow
def test_a_planned_publication_that_fails_is_set_aside(worlds: tuple[World, World]) -> None:
    bad, good = worlds
    broken, fine = planned(bad, [{"no": "entry"}]), planned(good, [])
    server = bad.server

    def run(gym: str) -> None:
        publish_due(server.database, UUID(gym))

    do_all(server, Task(PUBLICATIONS, run, plans.record_failure))
    with server.database.reading() as session:
        plan = session.get_one(Plan, broken)
        assert session.get_one(Scan, fine).state == State.PUBLISHED
        assert session.get_one(Scan, broken).state == State.REVIEW
        assert "could not be published" in plan.error
        assert "KeyError" not in plan.error  # the gym reads it


@pytest.mark.slow
@pytest.mark.parametrize("poison", [{"secret": "whsec_A"}, {"url": f"https://{'a' * 64}.example/"}])
def test_a_webhook_that_fails_is_set_aside(
    worlds: tuple[World, World], poison: dict[str, str]
) -> None:
    bad, good = worlds
    server = bad.server
    with listener() as (url, received):
        with server.database.writing() as session:
            rows = [
                Webhook(gym_id=world.gym.id, url=url, secret="whsec_AAAA") for world in (bad, good)
            ]
            session.add_all(rows)
            session.flush()
            for name, value in poison.items():
                setattr(rows[0], name, value)
            for world in worlds:
                queue_webhook_message(session, world.gym.id, "wall.published")
        do_all(server, delivery(server))
    assert len(received) == 1
    (facts,) = server.ask("GET", f"{bad.path}/webhooks", bad.owner).json()
    assert facts["waiting"] == 0
    assert facts["error"]
    assert facts["deliveries"][0]["error"] == facts["error"]
    assert facts["deliveries"][0]["tries"] == DELIVERY.max_tries
    (fine,) = server.ask("GET", f"{good.path}/webhooks", good.owner).json()
    assert (fine["waiting"], fine["error"]) == (0, "")
    assert fine["deliveries"][0]["delivered_at"] is not None


def queue_message(world: World, kind: str, target: str, **body: object) -> None:
    person = world.people["member"].id
    assert person is not None
    row = Message(
        id=uuid4(),
        person_id=person,
        gym_id=world.gym.id,
        kind=kind,
        subject=str(uuid4()),
        target=target,
        body=body,
        error="",
    )
    with world.server.database.writing() as session:
        session.add(row)
        job = MAILS if kind == DIGEST else PUSHES
        enqueue(session, job, str(row.id), gym=world.gym.id)


def wish(world: World) -> None:
    """The member wants everything, at any hour."""
    answer = world.server.ask("PUT", "/me/messages", world.people["member"], EVERYTHING)
    assert answer.is_success


@pytest.mark.slow
def test_a_mail_that_cannot_be_sent_is_set_aside(
    worlds: tuple[World, World], monkeypatch: pytest.MonkeyPatch
) -> None:
    bad, good = worlds
    server = bad.server
    send, poisoned = server.outbox.hand_over, bad.people["member"].email

    def hand_over(letter: Mail) -> None:
        if letter.to == poisoned:
            raise ValueError("Header values may not contain linefeed")
        send(letter)

    monkeypatch.setattr(server.outbox, "hand_over", hand_over)
    words: dict[str, object] = {"subject": "News", "lines": []}
    for world in worlds:
        wish(world)
        queue_message(world, DIGEST, "mail", **words)
    _tell_all(server)
    letters = [letter.to for letter in server.outbox.mails if letter.subject == "News"]
    assert letters == [good.people["member"].email]
    _is_given_up(bad, "linefeed")


def test_a_push_that_cannot_be_sent_is_set_aside(worlds: tuple[World, World]) -> None:
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
            queue_message(world, "new_routes", str(row.id), **shown)
        queue_message(bad, "new_routes", "no id of an address", **shown)
        _tell_all(server)
        assert len(service.got) == 1
    finally:
        service.close()
    _is_given_up(bad, "")


def test_a_gym_whose_news_cannot_be_found_delays_no_other(
    worlds: tuple[World, World],
) -> None:
    bad, good = worlds
    server = bad.server
    for world in worlds:
        wish(world)
        queue_message(world, "new_routes", str(uuid4()), title="t")
    with server.database.writing() as session:
        row = update(Gym).where(Gym.id == bad.gym.id)
        session.execute(row.values(time_zone="Nowhere/Else"))
    try:
        store_due_messages(server.database)
        _tell_all(server)
    finally:  # others share the server
        with server.database.writing() as session:
            row = update(Gym).where(Gym.id == bad.gym.id)
            session.execute(row.values(time_zone="UTC"))
    with server.database.reading() as session:
        rows = {row.gym_id: row for row in session.scalars(select(Message))}
    assert rows[good.gym.id].error == ""
    assert rows[good.gym.id].sent_at is not None
    _is_given_up(bad, "Nowhere")


def _tell_all(server: Server) -> None:
    settings = server.settings.model_copy(update={"webhooks_to_private": True})
    worker = MessageSender(settings, server.database, server.outbox)
    do_all(
        server, Task(MAILS, worker.mail, record_failure), Task(PUSHES, worker.push, record_failure)
    )


def _is_given_up(world: World, why: str) -> None:
    """The row stays, is tried no more, and says why."""
    with world.server.database.reading() as session:
        rows = session.scalars(select(Message).where(Message.gym_id == world.gym.id)).all()
    assert rows
    for row in rows:
        assert row.error
        assert why in row.error
        assert row.sent_at is not None


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
    try:
        done = purge(server.settings, server.database, store)
    finally:
        (folder / "0-a-folder").rmdir()
    assert dropped == keys[1:] == done.files
    assert [name for name, _ in done.failed] == [keys[0], str(folder / "0-a-folder")]
    assert not (folder / "stray.txt").exists()


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
        with server.incoming.appending(photos[-1], 0) as stream:
            stream.write(b"poi1" if world is bad else b"good")
    put = FileStore.put

    def put_most(self: FileStore, key: str, source: Path | bytes) -> None:
        if source == server.incoming.path(photos[0]):
            raise OSError("poison")
        put(self, key, source)

    monkeypatch.setattr(FileStore, "put", put_most)
    try:
        finish_all(server.database, services.store, server.incoming)
    finally:
        (server.settings.data / "incoming" / "notes.txt").unlink(missing_ok=True)
    assert photos_of(good) == {"a.jpg": "received"}
    assert photos_of(bad) == {"a.jpg": "receiving"}
