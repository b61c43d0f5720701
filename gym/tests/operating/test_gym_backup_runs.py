"""Daily backups: made at the target, tried, counted, and reported when they fail."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from gym.tests.hurried import do_all, forget_jobs, waiting
from gym.tests.storage.test_gym_store import objects, s3
from gym.tests.worlds import Outbox, Server, World
from sqlalchemy import delete, select

from walltopo.cli import main
from walltopo.core import EnvironmentLacksError, InputError, SettingsError
from walltopo_gym.errors import ConflictError
from walltopo_gym.jobs.queue import Task
from walltopo_gym.operating import backup, backup_runs
from walltopo_gym.operating.backup_runs import (
    ALERTS,
    BACKUPS,
    BackupRuns,
    open_run,
    queue_run,
    record_failure,
    run_now,
)
from walltopo_gym.operating.backup_target import FACTS, WORK, backup_name, open_target
from walltopo_gym.operating.backup_trial import compare_restored
from walltopo_gym.operating.doctor import Finding, examine
from walltopo_gym.operating.restored import server_id
from walltopo_gym.scans.running import WorkerStopsError
from walltopo_gym.scans.stages import ScanSteps
from walltopo_gym.settings import GymSettings, load_settings
from walltopo_gym.storage.models import BackupRun
from walltopo_gym.work import chores_of

__all__ = ["objects", "s3"]


@pytest.fixture
def runs(server: Server, tmp_path: Path) -> BackupRuns:
    """The runs of a server whose backups go to an empty folder."""
    forget_jobs(server)
    with server.database.writing() as session:
        session.execute(delete(BackupRun))
    folder = tmp_path / "backups"
    folder.mkdir()
    return runs_to(server, str(folder))


def runs_to(server: Server, url: str, **settings: object) -> BackupRuns:
    changed = server.settings.model_copy(update={"backup_to": url, **settings})
    return BackupRuns(changed, server.database, server.services.store, Outbox())


LAST = datetime(2999, 12, 31, tzinfo=UTC)


def set_clock(monkeypatch: pytest.MonkeyPatch, at: datetime) -> None:
    """Let the names of new backups have this time."""
    monkeypatch.setattr(backup_runs, "backup_name", lambda server, _: backup_name(server, at))


def tasks(runs: BackupRuns) -> tuple[Task, Task]:
    return Task(BACKUPS, runs.run, record_failure), Task(ALERTS, runs.send_alert)


def rows(server: Server) -> list[BackupRun]:
    with server.database.reading() as session:
        return list(session.scalars(select(BackupRun).order_by(BackupRun.created_at)))


def names(settings: GymSettings) -> list[str]:
    return [one.name for one in open_target(settings).newest()]


def finding(settings: GymSettings) -> Finding:
    return next(one for one in examine(settings) if one.what == "backups")


@pytest.mark.both_databases("a trial needs a scratch database")
def test_the_daily_backup_is_made_and_tried(world: World, runs: BackupRuns) -> None:
    server = world.server
    assert finding(runs.settings).state == "look"
    runs.queue_daily()
    runs.queue_daily()
    assert len(waiting(server, BACKUPS.name)) == 1
    do_all(server, *tasks(runs))
    (row,) = rows(server)
    assert (row.kind, row.state, row.error) == ("make", "done", "")
    assert row.ended_at is not None
    (made,) = open_target(runs.settings).newest()
    assert made.name == row.name
    assert made.is_equal
    assert made.facts is not None
    assert made.facts.rows > 0
    assert made.summary.endswith(" files: equal")
    assert finding(runs.settings).state == "well"
    with server.database.reading() as session:
        assert open_run(session) is None


def test_a_bucket_takes_backups_as_a_folder_does(
    world: World, objects: str, runs: BackupRuns
) -> None:
    there = runs_to(world.server, f"{objects}/{uuid4().hex}")
    name = run_now(there, "make")
    (made,) = open_target(there.settings).newest()
    assert (made.name, made.is_equal) == (name, True)
    assert run_now(there, "try", name) == name
    assert [row.kind for row in rows(world.server)] == ["make", "try"]
    assert list(there.settings.data.glob(f"{WORK}*")) == []


def test_a_bucket_of_its_own_address_and_keys(
    world: World, s3: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in s3:
        monkeypatch.delenv(name, raising=False)
    there = runs_to(
        world.server,
        "s3://walls/elsewhere",
        backup_endpoint=s3["AWS_ENDPOINT"],
        backup_region="us-east-1",
        backup_access_key="k",
        backup_secret_key="s",
    )
    assert run_now(there, "make") in names(there.settings)


def test_an_old_backup_goes_after_an_equal_newer_one(
    world: World, runs: BackupRuns, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = replace(runs, settings=runs.settings.model_copy(update={"backups_kept": 2}))
    first = run_now(runs, "make")
    folder = Path(runs.settings.backup_to)
    (folder / "mine.tar").write_bytes(b"not made here")
    (folder / f"{first}{FACTS}").rename(folder / "kept")
    # The newest one was not tried: nothing goes.
    server = server_id(runs.database)
    old = [f"walltopo-{server}-2020010{day}T000000Z.tar" for day in (1, 2)]
    for name in old:
        (folder / name).write_bytes(b"old")
    assert open_target(runs.settings).drop_old(server, first, 2) == []
    (folder / "kept").rename(folder / f"{first}{FACTS}")
    for name in old:
        facts = open_target(runs.settings).find(first).facts
        assert facts is not None
        open_target(runs.settings).save_facts(name, facts)
    set_clock(monkeypatch, LAST)
    second = run_now(runs, "make")
    assert set(names(runs.settings)) == {first, second, "mine.tar"}


def test_a_backup_that_is_not_equal_replaces_none(
    world: World, runs: BackupRuns, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = replace(runs, settings=runs.settings.model_copy(update={"backups_kept": 1}))
    first = run_now(runs, "make")

    def differ(*given: Any) -> Any:
        return replace(compare_restored(*given), differences=("table people: missing",))

    monkeypatch.setattr(backup_runs, "compare_restored", differ)
    set_clock(monkeypatch, LAST)
    with pytest.raises(EnvironmentLacksError, match="table people: missing"):
        run_now(runs, "make")
    assert first in names(runs.settings)
    assert rows(world.server)[-1].state == "failed"
    found = finding(runs.settings)
    assert (found.state, "table people: missing" in found.message) == ("bad", True)


def test_operators_get_one_mail_until_a_backup_succeeds(world: World, runs: BackupRuns) -> None:
    server = world.server
    outbox = runs.mailer
    assert isinstance(outbox, Outbox)
    operator = server.person("operator").email
    away = replace(runs, settings=runs.settings.model_copy(update={"backup_to": "/nowhere/at/all"}))

    def fail() -> None:
        away.queue_daily()
        do_all(server, *tasks(away))

    def mails() -> int:
        return len([mail for mail in outbox.mails if mail.to == operator])

    fail()
    assert rows(server)[-1].state == "failed"
    assert "is not there" in rows(server)[-1].error
    assert mails() == 1
    assert "is not there" in outbox.mails[-1].text
    fail()
    assert mails() == 1
    run_now(runs, "make")
    fail()
    assert mails() == 2
    run_now(runs, "make")
    with pytest.raises(InputError):
        run_now(away, "make")
    do_all(server, *tasks(away))
    assert mails() == 3
    fail()
    assert mails() == 3


def test_a_killed_run_leaves_no_part_of_a_backup(world: World, runs: BackupRuns) -> None:
    folder = Path(runs.settings.backup_to)
    own, other = (folder / f"{WORK}{one}" for one in (server_id(runs.database), "another"))
    for work in (own, other):
        work.mkdir()
        (work / "walltopo-20200101T000000Z.tar").write_bytes(b"half")
    assert names(runs.settings) == []
    run_now(runs, "make")
    assert not own.exists()
    assert other.exists()
    assert len(list(folder.iterdir())) == 3


def test_backups_of_a_clock_that_ran_ahead_replace_no_later_ones(
    world: World, runs: BackupRuns, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = replace(runs, settings=runs.settings.model_copy(update={"backups_kept": 2}))
    made = []
    days = (LAST, LAST + timedelta(days=1), *(datetime(2026, 12, n, tzinfo=UTC) for n in (1, 2, 3)))
    for day in days:
        set_clock(monkeypatch, day)
        made.append(run_now(runs, "make"))
    assert set(names(runs.settings)) == {*made[:2], *made[-2:]}


def test_two_servers_share_a_target(
    world: World, runs: BackupRuns, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "second").mkdir()
    second = Server(tmp_path / "second")
    both = [
        replace(one, settings=one.settings.model_copy(update={"backups_kept": 1}))
        for one in (runs, runs_to(second, runs.settings.backup_to))
    ]
    set_clock(monkeypatch, datetime(2999, 12, 30, tzinfo=UTC))
    first = [run_now(one, "make") for one in both]
    assert len(set(first)) == 2
    set_clock(monkeypatch, LAST)
    last = run_now(both[0], "make")
    assert set(names(runs.settings)) == {last, first[1]}
    # That the other one's backups are made says nothing about its own.
    (Path(runs.settings.backup_to) / first[1]).unlink()
    assert finding(both[0].settings).state == "well"
    assert finding(both[1].settings).state == "look"
    second.close()


def test_a_run_that_was_killed_before_its_trial_goes_on_with_it(
    world: World, runs: BackupRuns, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = run_now(runs, "make")
    file = Path(runs.settings.backup_to) / name
    (file.parent / f"{name}{FACTS}").unlink()
    before = file.stat().st_ino, file.stat().st_mtime_ns
    monkeypatch.setattr(backup_runs, "backup_name", lambda server, at: name)
    run_now(runs, "make")
    assert (file.stat().st_ino, file.stat().st_mtime_ns) == before
    assert open_target(runs.settings).find(name).is_equal


def test_a_worker_that_stops_leaves_no_part_of_a_backup(world: World, runs: BackupRuns) -> None:
    world.server.services.store.put("content/stop", b"a file")
    runs.stopping.set()
    with pytest.raises(WorkerStopsError):
        run_now(runs, "make")
    assert list(Path(runs.settings.backup_to).iterdir()) == []


def test_a_disk_that_is_full_in_the_middle_leaves_no_part_of_a_backup(
    world: World, runs: BackupRuns, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = run_now(runs, "make")
    world.server.services.store.put("content/full", b"a file")

    def fill(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(backup, "_add_contents", fill)
    set_clock(monkeypatch, LAST)
    runs.queue_daily()
    do_all(world.server, *tasks(runs))
    assert (rows(world.server)[-1].state, "No space left" in rows(world.server)[-1].error) == (
        "failed",
        True,
    )
    assert names(runs.settings) == [before]
    assert list(Path(runs.settings.backup_to).glob(f"{WORK}*")) == []


def test_one_run_at_a_time(world: World, runs: BackupRuns) -> None:
    with world.server.database.writing() as session:
        queue_run(session, "make", "gym.tar")
    with pytest.raises(ConflictError), world.server.database.writing() as session:
        queue_run(session, "make", "gym.tar")


def test_an_empty_server_lists_the_backups_at_the_target(
    world: World,
    runs: BackupRuns,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    name = run_now(runs, "make")
    monkeypatch.setenv("WALLTOPO_GYM_BACKUP_TO", runs.settings.backup_to)
    assert main(["gym", "backups", "--data", str(tmp_path / "empty")]) == 0
    printed = capsys.readouterr().out
    assert name in printed
    assert " files: equal" in printed


def test_the_command_makes_and_tries_a_backup_at_the_target(
    world: World,
    runs: BackupRuns,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    settings = world.server.settings
    place = ["--data", str(settings.data), "--database", settings.database_url]
    assert main(["gym", "backups", "make", *place]) == 3
    monkeypatch.setenv("WALLTOPO_GYM_BACKUP_TO", runs.settings.backup_to)
    assert main(["gym", "backups", "make", *place]) == 0
    assert ": equal" in capsys.readouterr().out
    (name,) = names(runs.settings)
    assert main(["gym", "backups", "try", name, *place]) == 0
    assert main(["gym", "backups", "try", *place]) == 3
    assert main(["gym", "backups", "try", "none.tar", *place]) == 3


def test_a_folder_at_the_target_that_nobody_may_enter_is_not_entered(runs: BackupRuns) -> None:
    name = run_now(runs, "make")
    folder = Path(tempfile.mkdtemp())
    try:
        (folder / name).write_bytes(b"a backup")
        (folder / "lost+found").mkdir(mode=0o700)
        folder.chmod(0o755)
        if os.geteuid() == 0:
            os.seteuid(65534)  # nobody; root enters everything
        else:
            (folder / "lost+found").chmod(0)
        there = runs.settings.model_copy(update={"backup_to": str(folder)})
        assert names(there) == [name]
    finally:
        if os.getuid() == 0:
            os.seteuid(0)
        shutil.rmtree(folder)


def test_places_that_are_no_targets_are_refused(server: Server, tmp_path: Path) -> None:
    inside = server.settings.data / "backups"
    inside.mkdir(exist_ok=True)
    with pytest.raises(ConflictError, match="no place for backups"):
        open_target(server.settings)
    with pytest.raises(SettingsError, match="data folder"):
        open_target(server.settings.model_copy(update={"backup_to": str(inside)}))
    with pytest.raises(InputError, match="not there"):
        open_target(server.settings.model_copy(update={"backup_to": str(tmp_path / "none")}))
    own = {"backup_to": "s3://walls/backups", "objects": "s3://walls"}
    with pytest.raises(SettingsError, match="store of files"):
        open_target(server.settings.model_copy(update=own))
    with pytest.raises(SettingsError, match="backup_to"):
        load_settings({"data": tmp_path, "backup_to": "ftp://host/backups"}, {})


def test_the_schedule_follows_the_settings(server: Server, runs: BackupRuns) -> None:
    def schedule(settings: GymSettings) -> list[str]:
        steps = ScanSteps(settings, server.database, server.services.store, settings.data)
        return [chore.at for chore in chores_of(steps) if chore.name == "backups-daily"]

    assert schedule(server.settings) == []
    assert schedule(runs.settings.model_copy(update={"backup_hour": 21})) == ["7 21 * * *"]
