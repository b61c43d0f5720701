"""The log in the database: no save is lost, and nothing is published that does not show it."""

from __future__ import annotations

import pytest
from gym.tests.worlds import World, hold

from walltopo.scans.edits import EditLog, Ref, Remove
from walltopo_gym.errors import ConflictError
from walltopo_gym.scans.edits import mark_shown, read_log, save_log
from walltopo_gym.scans.models import Scan

LOG = EditLog(edits=(Remove(hold=Ref(id=1)),))


def test_a_save_counts_once_and_the_second_of_two_is_refused(world: World) -> None:
    database, scan = world.server.database, world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    with database.writing() as session:
        assert save_log(session, scan, LOG, 0) == 1
    with pytest.raises(ConflictError, match="saved edits since"), database.writing() as session:
        save_log(session, scan, EditLog(), 0)
    with database.writing() as session:
        assert save_log(session, scan, EditLog(), 1) == 2
    with database.reading() as session:
        saved = read_log(session, scan)
    assert (saved.log, saved.revision, saved.shown, saved.is_pending) == (EditLog(), 2, 0, True)


def test_nothing_is_published_that_does_not_show_what_was_saved(world: World) -> None:
    database, scan = world.server.database, world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    with database.writing() as session:
        save_log(session, scan, LOG, 0)
    refused = world.publish(scan, {"number": 1})
    assert refused.status_code == 409
    assert "being applied" in refused.json()["title"]
    with database.writing() as session:
        mark_shown(session, scan, 1, {})
    assert world.publish(scan, {"number": 1}).status_code == 200
    with pytest.raises(ConflictError, match="published"), database.writing() as session:
        save_log(session, scan, EditLog(), 1)
    # A late result does not change a published scan.
    with database.writing() as session:
        mark_shown(session, scan, 1, {"page/evil.js": {}})
    with database.reading() as session:
        assert session.get_one(Scan, scan).files == {}
