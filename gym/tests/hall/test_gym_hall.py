"""The screen, its link, the board for everybody, feeds, short addresses, paper."""

from __future__ import annotations

from datetime import date, timedelta
from typing import Any
from urllib.parse import unquote
from uuid import UUID
from xml.etree import ElementTree

import pytest
from gym.tests.printed import codes_of, pages_of
from gym.tests.worlds import NOBODY, ORIGIN, Server, Somebody, World, hold, make_world
from hypothesis import given
from hypothesis import strategies as st
from icalendar import Calendar

from walltopo.describe.classify.palette import REFERENCE, name_of
from walltopo.describe.settings import ClassifySettings
from walltopo_gym.accounts.models import Profile
from walltopo_gym.climbing.counting import recount_gym
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hall import cards as card_room
from walltopo_gym.hall.cards import Cards
from walltopo_gym.hall.coming import MIN
from walltopo_gym.hall.screen import KIOSK
from walltopo_gym.languages import LANGUAGES
from walltopo_gym.publishing.codes import code_of
from walltopo_gym.publishing.models import Route
from walltopo_gym.words import PAINT, words_in

ALL = ["routes", "wall", "climbers", "board", "dates"]
NAMES = ("Moonshine", "Žlutý kůň", "Straße <b>&", "漢字 Ωμέγα")


@pytest.fixture
def current(midday: None, server: Server) -> World:
    """A public gym with four routes, three of them new, one of which goes soon."""
    return hang(make_world(server, visibility="public"))


def hang(world: World) -> World:
    holds = [hold(number, number * 0.4, 1.0) for number in range(1, 5)]
    scan = world.reviewed({number: [number] for number in range(1, 5)}, holds)
    today = now().date()
    rows: list[dict[str, Any]] = [
        {"number": number, "name": name, "setter": "Jana", "set_on": str(today)}
        for number, name in enumerate(NAMES, 1)
    ]
    rows[3]["set_on"] = str(today - timedelta(days=60))
    rows[0]["strip_on"] = str(today + timedelta(days=5))
    assert world.publish(scan, *rows).is_success
    return world


def screen(world: World, who: Somebody = NOBODY) -> dict[str, Any]:
    answer = world.server.ask("GET", f"{world.path}/screen", who)
    assert answer.status_code == 200, answer.text
    payload: dict[str, Any] = answer.json()
    return payload


def choose(world: World, **other: object) -> None:
    body = {"parts": ALL, "seconds": 10, "days": 14, "board": True} | other
    assert world.server.ask("PUT", f"{world.path}/hall", world.owner, body).is_success


def climb(world: World, *names: str, **profile: bool) -> None:
    """Each of these people tops one route more than the one before."""
    routes = [UUID(route["id"]) for route in world.published()["routes"]]
    people = world.server.persons(*names)
    with world.server.database.writing() as session:
        for number, person in enumerate(people.values(), 1):
            assert person.id is not None
            add_member(session, world.gym.id, person.id, Role.MEMBER, person.id)
            session.add(Profile(person_id=person.id, **profile))
            for route in routes[:number]:
                session.add(
                    Ascent(
                        person_id=person.id,
                        gym_id=world.gym.id,
                        route_id=route,
                        gym_name="",
                        route_name="",
                        grade="",
                        kind="top",
                        tries=2,
                        climbed_at=now(),
                        worth=100,
                        climbed_route=route,
                    )
                )
    recount_gym(world.server.database, world.gym.id)


def test_the_screen_shows_what_is_new_and_what_comes(current: World) -> None:
    payload = screen(current)
    assert {route["name"] for route in payload["routes"]} == set(NAMES[:3])
    assert [wall["name"] for wall in payload["walls"]] == ["Cave"]
    assert [(d["kind"], d["number"], d["name"]) for d in payload["dates"]] == [("strip", 1, "Cave")]
    assert (payload["board"], payload["climbers"]) == (None, None)


def test_few_climbers_are_not_counted_aloud(current: World) -> None:
    climb(current, *(f"c{n}" for n in range(MIN - 1)))
    assert screen(current)["climbers"] is None
    climb(current, "one-more")
    assert screen(current)["climbers"] == MIN


def test_on_the_board_for_everybody_are_those_who_agreed(current: World) -> None:
    climb(current, "Hidden", "Only-gym", on_boards=True)
    climb(current, "Ann", "Bea", on_boards=True, on_screens=True)
    climb(current, "Odd", on_screens=True)
    assert screen(current)["board"] is None  # the gym has not chosen it
    choose(current)
    board = screen(current)["board"]
    assert [(line["rank"], line["name"]) for line in board] == [(1, "Bea"), (2, "Ann")]
    assert set(board[0]) == {"rank", "name", "points"}
    body = {"boards": "off"}
    assert current.server.ask("PATCH", current.path, current.owner, body).is_success
    assert screen(current)["board"] is None


def test_a_private_gyms_screen_opens_by_its_link_until_it_is_taken_back(server: Server) -> None:
    ours, theirs = hang(make_world(server)), make_world(server)
    link = server.ask("POST", f"{ours.path}/hall/key", ours.owner).json()["link"]
    secret = link.partition("#")[2]
    assert link.startswith(f"{ORIGIN}/kiosk/g/{ours.gym.slug}#")
    wrong = server.ask("POST", f"{theirs.path}/screen/open", json={"secret": secret})
    assert (wrong.status_code, wrong.json()["code"]) == (404, "screen-link-unknown")
    opened = server.ask("POST", f"{ours.path}/screen/open", json={"secret": secret})
    assert opened.status_code == 204
    cookie = opened.headers["set-cookie"]
    assert all(word in cookie for word in (KIOSK, "HttpOnly", "Secure", "SameSite=lax"))
    kiosk = Somebody(headers={"cookie": f"{KIOSK}={secret}"})
    assert screen(ours, kiosk)["walls"]
    wall = f"{ours.path}/walls/{ours.wall.id}/published"
    assert server.ask("GET", wall, kiosk).status_code == 200
    # A guest, of this gym alone; the link gives a signed-in person nothing.
    assert server.ask("GET", f"{theirs.path}/screen", kiosk).status_code == 404
    assert server.ask("GET", f"{ours.path}/hall", kiosk).status_code == 401
    assert server.ask("POST", f"{ours.path}/join", kiosk).status_code == 401
    stranger = ours.people["stranger"].headers["cookie"]
    both = Somebody(headers={"cookie": f"{stranger}; {KIOSK}={secret}"})
    assert server.ask("POST", f"{ours.path}/join", both).status_code == 404
    # Another link, or none: this one opens nothing.
    other = server.ask("POST", f"{ours.path}/hall/key", ours.owner).json()["link"]
    assert server.ask("GET", f"{ours.path}/screen", kiosk).status_code == 404
    kiosk = Somebody(headers={"cookie": f"{KIOSK}={other.partition('#')[2]}"})
    assert screen(ours, kiosk)
    assert server.ask("DELETE", f"{ours.path}/hall/key", ours.owner).status_code == 204
    assert server.ask("GET", f"{ours.path}/screen", kiosk).status_code == 404


def test_a_short_address_leads_to_its_route(server: Server, current: World) -> None:
    route = current.published()["routes"][0]
    code = code_of(UUID(route["id"]))
    place = f"/g/{current.gym.slug}/w/{current.wall.id}/r/{route['id']}"
    for spelt in (code, code.lower(), f"{code[:5]}-{code[5:]}"):
        answer = server.client().get(f"/r/{spelt}", follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (302, place)
    payload = server.ask("GET", f"/short/{code}").json()
    assert payload == {
        "gym": current.gym.slug,
        "wall_id": str(current.wall.id),
        "route_id": route["id"],
    }
    for none in ("0000000000", "U" * 10, "1", "é" * 10):
        assert server.ask("GET", f"/short/{none}").status_code == 404


def test_of_a_private_gyms_route_strangers_learn_nothing(server: Server) -> None:
    world = hang(make_world(server))
    code = code_of(UUID(world.published()["routes"][0]["id"]))
    assert server.client().get(f"/r/{code}", follow_redirects=False).status_code == 200
    assert server.ask("GET", f"/short/{code}", world.people["stranger"]).status_code == 404
    assert server.ask("GET", f"/short/{code}", world.people["member"]).status_code == 200


@given(st.uuids())
def test_codes_are_the_first_bits_of_ids(route: UUID) -> None:
    code = code_of(route)
    number = 0
    for letter in code:
        number = number * 32 + "0123456789ABCDEFGHJKMNPQRSTVWXYZ".index(letter)
    assert len(code) == 10
    assert number == route.int >> 78


def test_the_calendar_can_be_read(current: World) -> None:
    scan = current.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    at = now().replace(microsecond=0) + timedelta(days=2)
    plan = {"revision": 1, "routes": [{"number": 1}], "at": at.isoformat()}
    put = current.server.ask(
        "PUT", f"{current.path}/scans/{scan}/plan", current.people["setter"], plan
    )
    assert put.is_success, put.text
    answer = current.server.ask("GET", f"{current.path}/calendar.ics?language=de")
    assert answer.headers["content-type"].startswith("text/calendar")
    events = {str(e["summary"]): e for e in Calendar.from_ical(answer.content).walk("VEVENT")}
    assert set(events) == {"Neue Routen: Cave", "Bald weg, Cave: 1"}
    assert events["Neue Routen: Cave"].decoded("dtstart") == at
    assert events["Bald weg, Cave: 1"].decoded("dtstart") == now().date() + timedelta(days=5)
    again = current.server.ask(
        "GET",
        f"{current.path}/calendar.ics?language=de",
        headers={"if-none-match": answer.headers["etag"]},
    )
    assert (again.status_code, again.content) == (304, b"")


def test_the_feed_of_new_routes_can_be_read(current: World) -> None:
    answer = current.server.ask("GET", f"{current.path}/new-routes.atom")
    assert answer.headers["content-type"].startswith("application/atom+xml")
    feed = ElementTree.fromstring(answer.content)
    space = {"a": "http://www.w3.org/2005/Atom"}
    titles = {str(e.findtext("a:title", "", space)).strip() for e in feed.findall("a:entry", space)}
    assert titles == set(NAMES[:3])
    assert feed.findtext("a:id", "", space) == f"urn:uuid:{current.gym.id}"


def test_cards_and_poster_as_the_setter_gets_them(current: World) -> None:
    ids = {route["id"]: route["name"] for route in current.published()["routes"]}
    setter = current.people["setter"]
    path = f"{current.path}/cards.pdf?size=a6&language=de&text=Bitte%20putzen"
    answer = current.server.ask("GET", path, setter)
    assert answer.headers["content-type"] == "application/pdf"
    assert "cards-a6.pdf" in answer.headers["content-disposition"]
    assert unquote(answer.headers["x-not-printed"]) == "字漢"
    pages = pages_of(answer.content)
    words = pages[0].get_textpage().get_text_range()
    assert len(pages) == 1
    assert all(word in words for word in ("Moonshine", "Žlutý kůň", "?? Ωμέγα", "Geschraubt von"))
    wanted = {f"{ORIGIN}/r/{code_of(UUID(id))}" for id in ids}
    assert codes_of(pages[0], 2, 2) == wanted
    poster = current.server.ask("GET", f"{current.path}/poster.pdf?language=cs&size=a3", setter)
    (sheet,) = pages_of(poster.content)
    assert [round(side / 72 * 25.4) for side in sheet.get_size()] == [297, 420]
    words = sheet.get_textpage().get_text_range()
    assert "Nové cesty" in words
    assert NAMES[2] in words
    assert "Ωμέγα" not in words  # that one hangs for two months
    same = {"if-none-match": poster.headers["etag"]}
    again = current.server.ask(
        "GET", f"{current.path}/poster.pdf?language=cs&size=a3", setter, headers=same
    )
    assert again.status_code == 304
    other = f"{current.path}/cards.pdf?wall={UUID(int=7)}"
    assert current.server.ask("GET", other, setter).json()["code"] == "cards-none"


def a_route(number: int) -> Route:
    return Route(
        id=UUID(int=number << 78),
        name=f"Route {number}",
        colour="red",
        grade="6A",
        setter="Jana",
        set_on=date(2026, 3, 1),
    )


@pytest.mark.slow
@pytest.mark.parametrize(("size", "pages"), [("a4", 300), ("a7", 38)])
def test_three_hundred_cards(size: Any, pages: int) -> None:
    rows = [a_route(number) for number in range(1, 301)]
    content, missing = Cards(rows, "Gym", "", ORIGIN).pdf(words_in("en"), size)
    document = pages_of(content)
    assert (len(document), missing) == (pages, set())
    assert "Route 300" in document[pages - 1].get_textpage().get_text_range()


def test_too_many_cards_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(card_room, "MAX_CARDS", 2)
    with pytest.raises(Exception, match="more than 2 cards"):
        Cards([a_route(n) for n in range(3)], "Gym", "", ORIGIN).pdf(words_in("en"), "a7")


def test_paint_is_that_of_the_scans() -> None:
    # As paint on a screen: brighter than in photos, but each the scan's colour of that name.
    assert list(PAINT) == list(REFERENCE)
    weight = ClassifySettings().lightness_weight
    for name, shown in PAINT.items():
        red, green, blue = bytes.fromhex(shown.removeprefix("#"))
        assert name_of((red, green, blue), weight) == name


def test_every_language_has_all_words() -> None:
    english = words_in("en")
    for language in LANGUAGES:
        words = words_in(language)
        assert words.texts.keys() == english.texts.keys()
        assert words.colours.keys() == english.colours.keys() == PAINT.keys()
        assert len(words.texts["months"].split()) == 12
        assert "2026" in words.day(date(2026, 12, 31))
