"""Feeds: a calendar of dates (RFC 5545), and new routes as Atom (RFC 4287)."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, date, datetime, time, timedelta
from typing import Final
from xml.etree import ElementTree as Xml

from walltopo_gym.events import GymDate
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.words import Words

_ATOM: Final = "http://www.w3.org/2005/Atom"
_DAY: Final = timedelta(days=1)


def say_date(coming: GymDate, words: Words) -> str:
    """Return a date's description in a line."""
    if coming.kind == "strip":
        return words.say("goes_on", number=coming.number, wall=coming.name)
    return words.say("reset", wall=coming.name) if coming.kind == "reset" else coming.name


def calendar(gym: Gym, dates: Sequence[GymDate], words: Words, base: str) -> bytes:
    """Return the dates as a calendar for subscriptions."""
    from icalendar import Calendar, Event

    made = Calendar()
    made.add("prodid", "-//walltopo//gym//EN")
    made.add("version", "2.0")
    made.add("x-wr-calname", gym.name)
    for coming in dates:
        event = Event()
        event.add("uid", f"{coming.id}@{gym.id}")
        # Fixed, so that the same dates are the same bytes.
        event.add("dtstamp", datetime.combine(_day(coming), time(), UTC))
        event.add("dtstart", coming.at)
        if isinstance(coming.at, datetime):
            event.add("dtend", coming.end or coming.at + timedelta(hours=1))
        else:
            event.add("dtend", coming.at + _DAY)
            event.add("transp", "TRANSPARENT")
        event.add("summary", say_date(coming, words))
        event.add("url", base + coming.path)
        if gym.place:
            event.add("location", gym.place)
        made.add_component(event)
    content: bytes = made.to_ical()
    return content


def _day(coming: GymDate) -> date:
    return coming.at.date() if isinstance(coming.at, datetime) else coming.at


def atom(
    gym: Gym, routes: Sequence[Route], walls: dict[object, str], words: Words, base: str, own: str
) -> bytes:
    """Return new routes, the newest first.

    Parameters
    ----------
    walls : their names by id; own : address of the feed.
    """
    Xml.register_namespace("", _ATOM)
    feed = Xml.Element(f"{{{_ATOM}}}feed")
    _add_element(feed, "title", f"{gym.name}: {words.say('new')}")
    _add_element(feed, "id", f"urn:uuid:{gym.id}")
    newest = max((route.created_at for route in routes), default=gym.created_at)
    _add_element(feed, "updated", newest.isoformat())
    _add_element(feed, "link", rel="self", href=own)
    _add_element(feed, "link", rel="alternate", href=f"{base}/g/{gym.slug}")
    for route in routes:
        entry = _add_element(feed, "entry")
        name = route.name or words.colour(route.colour)
        _add_element(entry, "title", " ".join(filter(None, (name, route.grade))))
        _add_element(entry, "id", f"urn:uuid:{route.id}")
        _add_element(entry, "updated", route.created_at.isoformat())
        page = f"{base}/g/{gym.slug}/w/{route.wall_id}/r/{route.id}"
        _add_element(entry, "link", rel="alternate", href=page)
        author = _add_element(entry, "author")
        _add_element(author, "name", route.setter or gym.name)
        parts = (walls[route.wall_id], words.colour(route.colour), words.day(route.set_on))
        _add_element(entry, "summary", " · ".join(filter(None, parts)))
    content: bytes = Xml.tostring(feed, encoding="utf-8", xml_declaration=True)
    return content


def _add_element(parent: Xml.Element, name: str, text: str = "", **attributes: str) -> Xml.Element:
    made = Xml.SubElement(parent, f"{{{_ATOM}}}{name}", attributes)
    made.text = text or None
    return made
