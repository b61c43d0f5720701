"""The operator's page and its commands: workers, queued mails, jobs, storage."""

from __future__ import annotations

import threading
from typing import Any
from uuid import uuid4

import pytest
from gym.tests.hurried import do_all, forget_jobs, waiting
from gym.tests.running import wait_for
from gym.tests.worlds import Server, Somebody, World
from sqlalchemy import delete, select

from walltopo.cli import main
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.clock import now
from walltopo_gym.jobs.models import Worker
from walltopo_gym.jobs.queue import Job, Task, enqueue
from walltopo_gym.jobs.worker import keep_slot, run_jobs
from walltopo_gym.jobs.worker_slot import WorkerSlot
from walltopo_gym.notifications.messages import DIGEST, MAIL, MAILS, message_row, store_messages
from walltopo_gym.notifications.models import Message
from walltopo_gym.operating.jobs import GIVEN_UP
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.service import State
from walltopo_gym.scans.stages import ScanSteps
from walltopo_gym.work import tasks_of

JOB = Job("test-job", waits=())


@pytest.fixture
def operator(server: Server) -> Somebody:
    return server.person("operator")


def command(server: Server, *words: str) -> int:
    place = ["--data", str(server.settings.data), "--database", server.settings.database_url]
    return main(["gym", *words, *place])


def read(server: Server, path: str, who: Somebody) -> Any:
    answer = server.ask("GET", f"/operator/{path}", who)
    assert answer.is_success, answer.text
    return answer.json()


def logged(server: Server, who: Somebody) -> list[tuple[str, str]]:
    """Return what the audit log says that somebody did."""
    with server.database.reading() as session:
        mine = select(AuditEntry).where(AuditEntry.person_id == who.id)
        rows = session.scalars(mine.order_by(AuditEntry.created_at))
        return [(row.action, row.subject) for row in rows]


def test_a_worker_gives_signs_of_life_until_it_ends(server: Server, operator: Somebody) -> None:
    with server.database.writing() as session:
        session.execute(delete(Worker))
    with WorkerSlot(server.settings, server.database) as slot, run_jobs(server.database, slot, []):
        stop = threading.Event()
        keeper = threading.Thread(target=keep_slot, args=(slot, stop, lambda _: None))
        keeper.start()
        try:
            (row,) = wait_for(lambda: read(server, "workers", operator))
            assert (row["name"], row["alive"]) == (slot.name, True)
            assert row["version"].count(".") >= 1
        finally:
            stop.set()
            keeper.join()
    assert read(server, "workers", operator) == []


def test_a_worker_that_was_killed_is_shown_as_gone(server: Server, operator: Somebody) -> None:
    with server.database.writing() as session:
        session.execute(delete(Worker))
        session.add(Worker(name="gone", version="0.1", seen_at=now().replace(year=now().year - 1)))
    (row,) = read(server, "workers", operator)
    assert row["alive"] is False


def test_the_command_lists_the_workers(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    with server.database.writing() as session:
        session.execute(delete(Worker))
        session.add(Worker(name="worker-3", version="0.2"))
    assert command(server, "workers") == 0
    assert "✓ worker-3 0.2 last seen " in capsys.readouterr().out


def a_mail(world: World, error: str, *, sent: bool) -> None:
    """Store a mail that waits, or that was given up."""
    person = world.owner.id
    assert person is not None
    row = message_row(world.gym, person, DIGEST, str(uuid4()), MAIL, {})
    row |= {"error": error, "sent_at": now() if sent else None}
    with world.server.database.writing() as session:
        store_messages(session, [row])


def test_the_mails_that_wait_are_sent_now(world: World, operator: Somebody) -> None:
    server = world.server
    forget_jobs(server)
    with server.database.writing() as session:
        session.execute(delete(Message))
    a_mail(world, "the mail server refused the recipient: 550", sent=True)
    assert read(server, "mails", operator) | {"error_at": None} == {
        "waiting": 0,
        "failed": 1,
        "error": "the mail server refused the recipient: 550",
        "error_at": None,
    }
    a_mail(world, "", sent=False)
    ways = iter([OSError("the mail server is away"), None])
    done = threading.Event()

    def send(message: str) -> None:
        why = next(ways)
        if why is not None:
            raise why
        done.set()

    job = Job(MAILS.name, waits=(3600.0,), of_one_gym=MAILS.of_one_gym, poll_s=0.05)
    with (
        WorkerSlot(server.settings, server.database) as slot,
        run_jobs(server.database, slot, [Task(job, send)]),
    ):
        listed = server.database.jobs.list_workflows
        wait_for(lambda: listed(name=MAILS.name, status="DELAYED"))
        answer = server.ask("POST", "/operator/mails/send", operator)
        assert answer.json() == {"count": 1}
        assert done.wait(60)
    assert ("mail.send-waiting", "") in logged(server, operator)


def test_the_command_for_mails_shows_the_last_error(
    world: World, capsys: pytest.CaptureFixture[str]
) -> None:
    a_mail(world, "550 no such user", sent=True)
    assert command(world.server, "mail", "queue") == 0
    assert "! 550 no such user" in capsys.readouterr().out
    assert command(world.server, "mail", "send") == 0
    assert "mails are sent now" in capsys.readouterr().out


def test_scans_are_listed_with_what_they_do_and_moved(world: World, operator: Somebody) -> None:
    server = world.server
    failed, queued = world.scan(State.FAILED, usable=3), world.scan(State.QUEUED)
    running = world.scan(State.RUNNING)
    with server.database.writing() as session:
        session.get_one(Scan, failed).error = "no photo overlaps another"
        session.add(ScanProgress(scan_id=running, stage="dense", doing="depth", notes=["slow"]))
    jobs = read(server, "jobs", operator)["scans"]
    found = {row["id"]: row for row in jobs if row["gym"] == world.gym.slug}
    assert found[str(failed)]["error"] == "no photo overlaps another"
    assert (found[str(running)]["stage"], found[str(running)]["notes"]) == ("dense", ["slow"])
    assert next(row["id"] for row in jobs if row["id"] in found) == str(running)
    assert server.ask("POST", f"/operator/scans/{failed}/retry", operator).status_code == 204
    assert server.ask("POST", f"/operator/scans/{queued}/cancel", operator).status_code == 204
    assert server.ask("POST", f"/operator/scans/{queued}/cancel", operator).status_code == 409
    states = {row["id"]: row["state"] for row in read(server, "jobs", operator)["scans"]}
    assert states[str(failed)] == "queued"
    assert str(queued) not in states
    done = logged(server, operator)
    assert done == [("scan.start", str(failed)), ("scan.cancel", str(queued))]


@pytest.mark.both_databases("queues")
@pytest.mark.parametrize("by_command", [False, True])
def test_a_job_that_was_set_aside_is_tried_again(
    world: World, operator: Somebody, by_command: bool
) -> None:
    server = world.server
    forget_jobs(server)
    tried: list[int] = []

    def run(number: int) -> None:
        tried.append(number)
        if len(tried) == 1:
            raise ValueError("the store is away")

    with server.database.writing() as session:
        enqueue(session, JOB, 7, gym=world.gym.id)
    do_all(server, Task(JOB, run))
    (aside,) = read(server, "jobs", operator)["set_aside"]
    assert (aside["kind"], aside["items"], aside["gym"]) == ("test-job", "7", world.gym.slug)
    assert "the store is away" in aside["error"]
    assert aside["can_retry"]
    if by_command:
        assert command(server, "jobs", "retry", aside["id"]) == 0
    else:
        again = server.ask("POST", "/operator/jobs/retry", operator, {"id": aside["id"]})
        assert again.status_code == 204
        assert logged(server, operator) == [("job.retry", "test-job")]
    assert waiting(server, JOB.name) == [(7,)]
    assert read(server, "jobs", operator)["set_aside"] == []
    do_all(server, Task(JOB, run))
    assert tried == [7, 7]


def test_a_job_whose_item_was_given_up_is_not_tried_again(world: World, operator: Somebody) -> None:
    server = world.server
    forget_jobs(server)

    def run(message: str) -> None:
        raise ValueError("poison")

    job = Job(MAILS.name, waits=())
    with server.database.writing() as session:
        enqueue(session, job, "m", gym=world.gym.id)
    do_all(server, Task(job, run))
    (aside,) = read(server, "jobs", operator)["set_aside"]
    assert not aside["can_retry"]
    again = server.ask("POST", "/operator/jobs/retry", operator, {"id": aside["id"]})
    assert (again.status_code, again.json()["code"]) == (409, "job-given-up")


def test_jobs_that_give_their_item_up_are_known(server: Server) -> None:
    steps = ScanSteps(server.settings, server.database, server.services.store, server.settings.data)
    assert {task.job.name for task in tasks_of(steps)} >= GIVEN_UP


def test_storage_is_measured_by_gym_and_kind(
    world: World, operator: Somebody, capsys: pytest.CaptureFixture[str]
) -> None:
    server, store = world.server, world.server.services.store
    scan = world.scan()
    sha = uuid4().hex * 2
    world.photo(scan, state="usable", sha256=sha)
    store.put(f"originals/{sha}", b"12345")
    store.put(f"thumbnails/{sha}.jpg", b"123")
    store.put(f"thumbnails/{sha}-1.jpg", b"123")
    store.put(f"scans/{scan}/holds.json", b"1234567")
    store.put(f"content/{uuid4().hex}", b"nobody's")
    with server.database.writing() as session:
        session.get_one(Scan, scan).files = {"i": {"key": f"content/{sha}", "size": 4, "type": ""}}
    store.put(f"content/{sha}", b"1234")
    answer = server.ask("POST", "/operator/storage/measure", operator)
    assert answer.is_success, answer.text
    rows = {
        (row["slug"], row["kind"]): (row["files"], row["bytes"]) for row in answer.json()["rows"]
    }
    assert {kind: count for (slug, kind), count in rows.items() if slug == world.gym.slug} == {
        "originals": (1, 5),
        "thumbnails": (2, 6),
        "scans": (1, 7),
        "published": (1, 4),
    }
    assert rows["", "published"][0] >= 1
    assert 0 < answer.json()["free"] < answer.json()["total"]
    assert read(server, "storage", operator)["measured_at"] is not None
    assert command(server, "storage") == 0
    assert world.gym.slug in capsys.readouterr().out
