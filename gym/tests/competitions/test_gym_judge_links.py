"""Judges' links: opened without an account, for one problem, until they are revoked or the round
ends."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timedelta
from typing import Any
from uuid import UUID, uuid4

import httpx
import pytest
from gym.tests.competitions.contest import Contest, score
from gym.tests.printed import codes_of, pages_of, words_of
from gym.tests.worlds import World
from sqlalchemy import select

from walltopo_gym.accounts import limits
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.clock import now
from walltopo_gym.competitions import judge_links, judging
from walltopo_gym.competitions.models import JudgeLink, LinkJudge, Round
from walltopo_gym.operating.own_data import all_of

ROUNDS = [
    {
        "name": name,
        "scoring": {"rules": "ifsc-2025"},
        "quota": quota,
        "problems": [{"name": "Moon"}, {"name": "Plum"}],
    }
    for name, quota in (("Qualification", None), ("Final", 2))
]


@dataclass
class Phone:
    """A browser without an account that opened a link."""

    contest: Contest
    secret: str
    link: str = ""
    cookie: str = ""

    def open(self, name: str = "Eva") -> httpx.Response:
        body = {"secret": self.secret, "name": name}
        answer = self.ask("POST", "/judge-links/open", body)
        if answer.is_success:
            self.link = answer.json()["id"]
            self.cookie = answer.headers["set-cookie"].partition(";")[0]
        return answer

    def ask(self, method: str, path: str, body: object = None) -> httpx.Response:
        headers = {"cookie": self.cookie} if self.cookie else {}
        return self.contest.world.server.ask(method, path, json=body, headers=headers)

    def pad(self) -> httpx.Response:
        return self.ask("GET", f"/judge-links/{self.link}/pad")

    def say(
        self, entry: str, kind: str, problem: str, n: int | None = 1, **words: Any
    ) -> httpx.Response:
        event = words.pop("event", None) or uuid4()
        body = score(entry, kind, problem, n, device="phone", **{"number": 1, **words})
        return self.ask("PUT", f"/judge-links/{self.link}/events/{event}", body)


def judged(world: World) -> Contest:
    """A private gym's cup, whose qualification runs."""
    contest = Contest(world, {"format": "rounds", "rounds": ROUNDS}).make()
    contest.move("running")
    return contest


def a_phone(contest: Contest, number: int = 0, one: int = 0) -> Phone:
    made = contest.ask("POST", f"/problems/{contest.problem(number, one)}/judge-links")
    assert made.status_code == 201, made.text
    address, _, secret = made.json()["link"].partition("#")
    assert address.endswith("/judge")
    return Phone(contest, secret)


def code(answer: httpx.Response) -> str:
    assert answer.is_client_error, answer.text
    found: str = answer.json()["code"]
    return found


def test_a_judge_without_an_account_scores_one_problem(world: World) -> None:
    contest = judged(world)
    jana, ivo = contest.entry("Jana", birth_year=1990), contest.entry("Ivo")
    phone = a_phone(contest)
    opened = phone.open()
    assert {"Secure", "HttpOnly", "SameSite=strict", "Path=/"} <= set(
        opened.headers["set-cookie"].split("; ")
    )
    pad = phone.pad().json()
    assert (pad["judge"], pad["problem"]["label"], pad["round"]) == ("Eva", "1", "Qualification")
    # No more of the competitors than a judge needs.
    assert [set(entry) for entry in pad["entries"]] == 2 * [{"id", "category_id", "bib", "name"}]
    event = uuid4()
    words: dict[str, Any] = {"event": event, "made_at": now().isoformat()}
    assert phone.say(jana, "top", contest.problem(0), 2, **words).status_code == 201
    assert phone.say(jana, "top", contest.problem(0), 2, **words).status_code == 200
    assert code(phone.say(ivo, "top", contest.problem(0), 2, **words)) == "id-taken"
    [mark] = phone.pad().json()["marks"]
    assert (mark["entry_id"], mark["top"]) == (jana, 2)
    [kept] = contest.ask("GET", "/events", who="judge").json()["items"]
    assert (kept["by_name"], kept["by_link"]) == ("Eva", "1")
    assert contest.ranks("setter")[0] == (1, "Jana")
    # An undo, also of what a judge with an account entered.
    undo = phone.say(jana, "void", contest.problem(0), None, target_id=str(event))
    assert undo.status_code == 201
    other = contest.say(ivo, "top", 0, 1).json()
    assert other["by_link"] is None
    assert phone.say(ivo, "void", contest.problem(0), None, target_id=other["id"]).is_success
    [link] = contest.ask("GET", "/judge-links").json()
    assert (link["label"], link["made_by"], link["revoked_at"]) == ("1", "setter", None)
    assert [judge["name"] for judge in link["judges"]] == ["Eva"]
    assert link["judges"][0]["used_at"] > link["judges"][0]["opened_at"]


def test_a_link_does_nothing_else(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    first, second = contest.problem(0), contest.problem(1)
    assert code(phone.say(jana, "top", second)) == "judge-link-problem"
    theirs = contest.say(jana, "top", 1, 1).json()["id"]
    wrong = phone.say(jana, "void", first, None, target_id=theirs)
    assert code(wrong) == "judge-link-problem"
    assert code(phone.say(jana, "top", first, target_id=theirs)) == "judge-link-problem"
    assert code(phone.say(jana, "appeal", first, None, text="no")) == "judge-link-scores"
    out = phone.say(jana, "out", first, None, problem_id=None, text="no")
    assert code(out) == "judge-link-scores"
    # The cookie signs nobody in: the gym is private.
    for path in ("/entries", "/events", "/board", ""):
        assert phone.ask("GET", contest.path + path).status_code in (401, 404)
    path = f"{contest.path}/events/{uuid4()}"
    assert phone.ask("PUT", path, {}).status_code in (401, 404)
    # Another link's pad does not open with this cookie.
    other = a_phone(contest, 1)
    other.open("Ida")
    phone.link, ours = other.link, phone.link
    assert code(phone.pad()) == "judge-link-not-open"
    phone.cookie = phone.cookie.replace(UUID(ours).hex, UUID(other.link).hex)
    assert code(phone.pad()) == "judge-link-not-open"


def test_a_forged_secret_opens_nothing(world: World) -> None:
    contest = judged(world)
    phone = a_phone(contest)
    forged = Phone(contest, new_secret()[0])
    assert code(forged.open()) == "judge-link-unknown"
    phone.open()
    phone.cookie = f"{phone.cookie.partition('=')[0]}={new_secret()[0]}"
    assert code(phone.pad()) == "judge-link-not-open"
    phone.cookie = ""
    assert phone.pad().status_code == 401
    with world.server.database.reading() as session:
        hashes = {*session.scalars(select(JudgeLink.token_hash))}
        hashes |= {*session.scalars(select(LinkJudge.token_hash))}
    assert phone.secret not in hashes
    assert all(len(one) == 64 for one in hashes)


def test_a_revoked_link_ends_at_once(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    assert phone.say(jana, "attempt", contest.problem(0)).status_code == 201
    for _ in range(2):
        assert contest.ask("DELETE", f"/judge-links/{phone.link}").status_code == 204
    assert code(phone.pad()) == "judge-link-revoked"
    assert code(phone.say(jana, "top", contest.problem(0), 2)) == "judge-link-revoked"
    assert code(phone.open()) == "judge-link-revoked"
    assert len(contest.ask("GET", "/events", who="judge").json()["items"]) == 1
    with world.server.database.reading() as session:
        rows = session.execute(select(AuditEntry.action, AuditEntry.details)).all()
    by_action = {action: details for action, details in rows if action.startswith("judge-link")}
    assert set(by_action) == {"judge-link.create", "judge-link.open", "judge-link.revoke"}
    assert (by_action["judge-link.open"]["judge"], by_action["judge-link.open"]["problem"]) == (
        "Eva",
        "1",
    )


def test_a_link_ends_with_its_round(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone, final = a_phone(contest), a_phone(contest, one=1)
    phone.open()
    assert final.open().is_success  # before the final begins, to be ready
    assert code(final.say(jana, "top", contest.problem(0, 1))) == "cup-round-not-begun"
    made = (now() - timedelta(minutes=1)).isoformat()
    contest.move_round(0, "ended")
    assert code(phone.pad()) == "judge-link-over"
    assert code(phone.open()) == "judge-link-over"
    assert code(phone.say(jana, "top", contest.problem(0))) == "cup-round-over"
    # Climbed before the end, and sent when the phone had reception again.
    late = phone.say(jana, "top", contest.problem(0), made_at=made)
    assert late.status_code == 201, late.text
    contest.ask("PATCH", "", {"late_minutes": 0})
    later = phone.say(jana, "zone", contest.problem(0), made_at=made)
    assert code(later) == "cup-round-over"
    closed = contest.ask("POST", f"/problems/{contest.problem(0)}/judge-links")
    assert code(closed) == "cup-round-over"
    contest.move_round(0, "running")  # reopened
    assert phone.pad().is_success


def test_a_judge_is_named_once_in_a_browser(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone, event = a_phone(contest), uuid4()
    phone.open()
    cookie = phone.cookie
    words: dict[str, Any] = {"event": event, "made_at": now().isoformat()}
    assert phone.say(jana, "top", contest.problem(0), **words).status_code == 201
    phone.open()
    assert phone.cookie == cookie
    phone.open("Ida")
    assert phone.cookie != cookie
    # An event from before is not stored a second time.
    assert phone.say(jana, "top", contest.problem(0), **words).status_code == 200
    [link] = contest.ask("GET", "/judge-links").json()
    assert {judge["name"] for judge in link["judges"]} == {"Eva", "Ida"}


def test_a_sheet_has_a_code_for_each_problem(world: World) -> None:
    contest = judged(world)
    one = contest.sheet["rounds"][0]["id"]
    answer = contest.ask("POST", f"/rounds/{one}/judge-sheet?language=de")
    assert answer.headers["content-type"] == "application/pdf"
    text = words_of(answer.content)
    for words in ("Spring Cup · Qualification", "Boulder 1", "Boulder 2", "Moon", "Kein Konto"):
        assert words in text
    links = contest.ask("GET", "/judge-links").json()
    assert sorted(link["label"] for link in links) == ["1", "2"]
    [page] = pages_of(answer.content)
    codes = codes_of(page, across=2, down=3)
    phones = [Phone(contest, code.partition("/judge#")[2]) for code in codes]
    assert {phone.open().is_success for phone in phones} == {True}
    assert {phone.pad().json()["problem"]["label"] for phone in phones} == {"1", "2"}


def test_links_of_a_problem_and_attempts_to_open_one_have_a_limit(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    contest = judged(world)
    path = f"/problems/{contest.problem(0)}/judge-links"
    made = [contest.ask("POST", path) for _ in range(21)]
    assert [answer.status_code for answer in made[-2:]] == [201, 409]
    assert made[-1].json()["values"] == {"problem": "1", "most": "20"}
    one = contest.sheet["rounds"][0]["id"]
    assert contest.ask("POST", f"/rounds/{one}/judge-sheet").status_code == 409
    final = a_phone(contest, one=1)
    for _ in range(2):
        assert contest.ask("DELETE", f"/rounds/{one}/judge-links").status_code == 204
    links = contest.ask("GET", "/judge-links").json()
    assert [link["round_id"] == one for link in links] == [
        bool(link["revoked_at"]) for link in links
    ]
    assert contest.ask("POST", f"/rounds/{one}/judge-sheet").is_success
    monkeypatch.setattr(limits, "_JUDGE_LINKS", limits.Limit("judge-link-test", 2, 900))
    phone = Phone(contest, new_secret()[0])
    assert [phone.open().status_code for _ in range(3)] == [404, 404, 429]
    assert final.open().is_success  # a right secret opens, whatever others in its network try


def test_judges_of_a_link_have_a_limit(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    contest = judged(world)
    phone = a_phone(contest)
    phone.open()
    monkeypatch.setattr(judge_links, "MAX_JUDGES", 1)
    assert phone.open().is_success
    assert code(phone.open("Ida")) == "judge-link-many"


def test_a_gym_without_competitions_has_no_links(world: World) -> None:
    contest = judged(world)
    phone = a_phone(contest)
    phone.open()
    off = {"features_off": ["competitions"]}
    assert world.server.ask("PATCH", world.path, world.owner, off).is_success
    assert phone.pad().status_code == 404
    assert phone.open().status_code == 404


def test_attempts_by_link_have_the_rounds_limit(world: World) -> None:
    rounds = [ROUNDS[0] | {"max_attempts": 2, "closes_at": None}]
    contest = Contest(world, {"rounds": rounds}).make()
    contest.move("running")
    jana, phone = contest.entry("Jana"), a_phone(contest)
    phone.open()
    assert phone.pad().json()["max_attempts"] == 2
    assert code(phone.say(jana, "attempt", contest.problem(0), 3)) == "event-attempts"


def test_a_link_strikes_no_appeal_and_no_decision(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    appeal = contest.say(jana, "appeal", 0, None, text="it was a top")
    assert appeal.is_success, appeal.text
    target = appeal.json()["id"]
    struck = phone.say(jana, "void", contest.problem(0), None, target_id=target)
    assert code(struck) == "judge-link-scores"


def test_an_ended_round_takes_nothing_by_link_whatever_its_planned_end(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    with world.server.database.writing() as session:
        row = session.get_one(Round, UUID(contest.sheet["rounds"][0]["id"]))
        row.state, row.closes_at = "ended", now() + timedelta(hours=1)
    assert code(phone.say(jana, "top", contest.problem(0))) == "cup-round-over"
    with world.server.database.writing() as session:
        row = session.get_one(Round, row.id)
        row.state, row.closes_at = "waiting", None
    assert code(phone.say(jana, "top", contest.problem(0))) == "cup-round-not-begun"


def test_a_link_enters_nothing_from_before_it_was_opened(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    with world.server.database.writing() as session:
        row = session.get_one(Round, UUID(contest.sheet["rounds"][0]["id"]))
        row.closes_at = now() - timedelta(minutes=5)
    old = (now() - timedelta(hours=5)).isoformat()
    late = phone.say(jana, "top", contest.problem(0), made_at=old, sent_at=now().isoformat())
    assert code(late) == "cup-round-over"


def test_links_of_an_ended_competition_are_closed(world: World) -> None:
    contest = judged(world)
    phone = a_phone(contest, 0, 1)  # of the round that never began
    phone.open()
    contest.move("ended")
    assert code(phone.pad()) == "judge-link-over"
    again = contest.ask("POST", f"/problems/{contest.problem(0, 1)}/judge-links")
    assert code(again) == "cup-round-over"


def test_a_pad_shows_nothing_of_accounts(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    assert contest.say(jana, "zone", 0, 1, text="held it for long").is_success
    assert phone.say(jana, "top", contest.problem(0), 2).is_success
    [mark] = phone.pad().json()["marks"]
    by_account, by_link = mark["events"]
    assert not {"text", "device", "seq"} & (by_account.keys() | by_link.keys())
    assert (by_account["by_name"], by_account["by_link"]) == ("", None)
    assert (by_link["by_name"], by_link["by_link"]) == ("Eva", "1")


def test_a_pad_in_use_keeps_its_cookie(world: World) -> None:
    phone = a_phone(judged(world))
    phone.open()
    again = phone.pad().headers["set-cookie"]
    assert again.partition(";")[0] == phone.cookie
    assert "Max-Age=604800" in again


def test_a_link_uses_up_no_events_of_judges_and_competitors(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(judging, "MAX_OWN_EVENTS", 2)
    contest = judged(world)
    jana = contest.entry("Jana")
    phones = [a_phone(contest), a_phone(contest)]
    for phone in phones:
        phone.open()
    answers = [phones[n % 2].say(jana, "attempt", contest.problem(0)) for n in range(3)]
    assert [answer.status_code for answer in answers] == [201, 201, 409]
    assert contest.say(jana, "top", 0, 2).status_code == 201


def test_after_its_round_a_link_strikes_only_its_own_results(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone, other = a_phone(contest), a_phone(contest)
    phone.open()
    other.open("Ida")
    made = (now() - timedelta(minutes=1)).isoformat()
    own = phone.say(jana, "top", contest.problem(0), 2).json()["id"]
    theirs = other.say(jana, "zone", contest.problem(0)).json()["id"]
    contest.move_round(0, "ended")
    words = {"made_at": made, "sent_at": now().isoformat()}
    for kind, n in (("void", None), ("attempt", 1)):
        struck = phone.say(jana, kind, contest.problem(0), n, target_id=theirs, **words)
        assert code(struck) == "judge-link-late"
    late = phone.say(jana, "void", contest.problem(0), None, target_id=own, **words)
    assert late.status_code == 201, late.text


def test_a_strike_that_was_prepared_strikes_nothing_after_the_round(world: World) -> None:
    contest = judged(world)
    jana = contest.entry("Jana")
    phone = a_phone(contest)
    phone.open()
    top = contest.say(jana, "top", 0, 1).json()["id"]
    made = (now() - timedelta(minutes=1)).isoformat()
    first = phone.say(jana, "void", contest.problem(0), None, target_id=top).json()["id"]
    second = phone.say(jana, "void", contest.problem(0), None, target_id=first).json()["id"]
    contest.move_round(0, "ended")
    words = {"made_at": made, "sent_at": now().isoformat(), "target_id": second}
    assert code(phone.say(jana, "void", contest.problem(0), None, **words)) == "judge-link-late"
    assert contest.ranks("setter")[0] == (1, "Jana")


def test_links_of_a_setter_who_left_are_closed(world: World) -> None:
    contest = judged(world)
    phone = a_phone(contest)
    phone.open()
    setter = world.people["setter"].id
    path = f"{world.path}/members/{setter}"
    assert world.server.ask("PATCH", path, world.owner, {"role": "judge"}).is_success
    assert code(phone.pad()) == "judge-link-maker"
    assert code(phone.open()) == "judge-link-maker"


def test_the_export_of_ones_data_names_links_but_no_secret(world: World) -> None:
    contest = judged(world)
    phone = a_phone(contest)
    with world.server.database.reading() as session:
        data = all_of(session, UUID(str(world.people["setter"].id)))
    [link] = data["competition_judge_links"]
    assert str(link["problem_id"]) == contest.problem(0)
    assert "token_hash" not in link
    assert phone.secret not in str(data)
