"""What messengers and search engines read of a page before any script runs (https://ogp.me).

Only of what everybody may see: of a private gym nothing is said, whoever asks.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.api.services import Services
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.publishing.models import Route
from walltopo_gym.scans.pictures import HEIGHT, WIDTH

__all__ = ["head_of"]

_SITE = "walltopo"


@dataclass(frozen=True)
class _Preview:
    """Title, one line, and the address of a picture; empty where there is none."""

    title: str
    line: str = ""
    picture: str = ""
    listed: bool = True


def head_of(services: Services, place: str, *, indexed: bool) -> str:
    """HTML of a page's title and tags.

    Parameters
    ----------
    place : path of the page, without a slash before it.
    indexed : whether search engines may keep the page.
    """
    parts = place.strip("/").split("/")
    with services.database.reading() as session:
        shown = _preview(session, parts)
    base = services.settings.link_base
    tags = [f"<title>{escape(shown.title)}</title>"]
    if not (indexed and shown.listed):
        tags.append('<meta name="robots" content="noindex">')
    told = {"site_name": _SITE, "type": "website", "title": shown.title, "url": f"{base}/{place}"}
    if shown.line:
        told["description"] = shown.line
    if shown.picture:
        told |= {
            "image": base + shown.picture,
            "image:width": str(WIDTH),
            "image:height": str(HEIGHT),
        }
        tags.append('<meta name="twitter:card" content="summary_large_image">')
    tags += [f'<meta property="og:{name}" content="{escape(text)}">' for name, text in told.items()]
    return "".join(tags)


def _preview(session: Session, parts: list[str]) -> _Preview:
    """Of the gym, wall or route that the path names, as far as there is one."""
    match parts:
        case ["g", slug, *rest]:
            gym = session.scalar(select(Gym).where(Gym.slug == slug, Gym.visibility != "private"))
            if gym is not None:
                return _of_gym(session, gym, rest)
    return _Preview(_SITE)


def _of_gym(session: Session, gym: Gym, rest: list[str]) -> _Preview:
    plain = _Preview(gym.name, gym.place, listed=gym.visibility == "public")
    if len(rest) < 2 or rest[0] != "w":
        return plain
    wall = session.get(Wall, key) if (key := _key(rest[1])) else None
    if wall is None or wall.gym_id != gym.id or wall.published_scan_id is None:
        return plain
    base = f"/api/v1/gyms/{gym.slug}"
    version = f"?v={wall.published_scan_id.hex[:8]}"
    if len(rest) >= 4 and rest[2] == "r" and (key := _key(rest[3])):
        route = session.get(Route, key)
        if route is not None and route.wall_id == wall.id:
            title = " ".join(filter(None, (route.name or route.colour, route.grade)))
            line = " · ".join(filter(None, (wall.name, gym.name, route.setter)))
            return _Preview(title, line, f"{base}/routes/{route.id}/picture{version}", plain.listed)
    line = " · ".join(filter(None, (gym.name, gym.place)))
    return _Preview(wall.name, line, f"{base}/walls/{wall.id}/picture{version}", plain.listed)


def _key(text: str) -> UUID | None:
    try:
        return UUID(text)
    except ValueError:
        return None
