"""Announcements of an operator: shown from a moment to another one, to everybody."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

import pytest
from gym.tests.operating.test_gym_operator_page import command, logged
from gym.tests.worlds import Server, Somebody
from sqlalchemy import delete

from walltopo.core import InputError
from walltopo_gym.announcements.models import Announcement
from walltopo_gym.clock import now


@pytest.fixture(autouse=True)
def _none_yet(server: Server) -> None:
    with server.database.writing() as session:
        session.execute(delete(Announcement))


@pytest.fixture
def operator(server: Server) -> Somebody:
    return server.person("operator")


def shown(server: Server) -> list[Any]:
    return [row["texts"] for row in server.ask("GET", "/announcements").json()]


def test_an_announcement_is_shown_in_its_time(server: Server, operator: Somebody) -> None:
    hour = timedelta(hours=1)
    for text, starts, ends in (
        ("now", None, None),
        ("later", now() + hour, None),
        ("over", now() - 2 * hour, now() - hour),
        ("still", now() - hour, now() + hour),
    ):
        body = {
            "texts": {"en": text, "de": " "},
            "starts_at": starts and starts.isoformat(),
            "ends_at": ends and ends.isoformat(),
        }
        made = server.ask("POST", "/operator/announcements", operator, body)
        assert made.status_code == 201, made.text
    assert shown(server) == [{"en": "now"}, {"en": "still"}]
    rows = server.ask("GET", "/operator/announcements", operator).json()["items"]
    assert [row["texts"]["en"] for row in rows] == ["still", "over", "later", "now"]
    for row in rows:
        path = f"/operator/announcements/{row['id']}"
        assert server.ask("DELETE", path, operator).status_code == 204
        assert server.ask("DELETE", path, operator).status_code == 404
    assert shown(server) == []
    actions = [action for action, _ in logged(server, operator)]
    assert actions == ["announcement.make"] * 4 + ["announcement.drop"] * 4


def test_an_announcement_has_a_text_and_ends_after_it_begins(
    server: Server, operator: Somebody
) -> None:
    for body, code in (
        ({"texts": {"en": "  "}}, "announcement-empty"),
        ({"texts": {"en": "x"}, "ends_at": now().isoformat()}, "announcement-ends-first"),
    ):
        refused = server.ask("POST", "/operator/announcements", operator, body)
        assert (refused.status_code, refused.json()["code"]) == (422, code)
    unknown = server.ask("POST", "/operator/announcements", operator, {"texts": {"xx": "x"}})
    assert unknown.status_code == 422


def test_few_announcements_are_shown_at_a_time(server: Server, operator: Somebody) -> None:
    for number in range(7):
        body = {"texts": {"en": str(number)}}
        assert server.ask("POST", "/operator/announcements", operator, body).is_success
    assert [texts["en"] for texts in shown(server)] == ["6", "5", "4", "3", "2"]


def test_the_command_announces(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    given = ("--en", "Update tonight", "--until", "2199-01-01T00:00")
    assert command(server, "announce", "add", *given) == 0
    line, text = capsys.readouterr().out.splitlines()
    assert line.endswith(" until 2199-01-01 00:00")
    assert text == "    en: Update tonight"
    assert shown(server) == [{"en": "Update tonight"}]
    assert (
        command(server, "announce", "add", "--en", "x", "--until", "soon") == InputError.exit_code
    )
    assert command(server, "announce", "delete", line.split()[0]) == 0
    assert shown(server) == []
