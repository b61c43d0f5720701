"""What messengers and search engines read of a page before any script runs (https://ogp.me), and
what a browser may fetch of it meanwhile.

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

_SITE = "walltopo"


@dataclass(frozen=True)
class _Preview:
    """Title, one line, and the addresses of a picture and of a wall's first tier; empty where there
    is none."""

    title: str
    line: str = ""
    picture: str = ""
    listed: bool = True
    tier: str = ""


def head_of(services: Services, place: str, viewer: str, *, indexed: bool) -> str:
    """HTML of a page's title and tags.

    Parameters
    ----------
    place : path of the page, without a slash before it.
    viewer : address of the script that shows walls.
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
    tags.append(f'<meta name="wall-viewer" content="{viewer}">')
    if shown.tier:
        # The app finds out only after some questions that it wants them; its own scripts go first.
        early = '<link rel="preload" fetchpriority="low" as='
        tags.append(f'{early}"script" href="{viewer}">')
        tags.append(f'{early}"fetch" crossorigin href="{shown.tier}">')
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
    tier = f"{base}/scans/{wall.published_scan_id}/files/page/first.glb"
    if len(rest) >= 4 and rest[2] == "r" and (key := _key(rest[3])):
        route = session.get(Route, key)
        if route is not None and route.wall_id == wall.id:
            title = " ".join(filter(None, (route.name or route.colour, route.grade)))
            line = " · ".join(filter(None, (wall.name, gym.name, route.setter)))
            picture = f"{base}/routes/{route.id}/picture{version}"
            return _Preview(title, line, picture, plain.listed, tier)
    line = " · ".join(filter(None, (gym.name, gym.place)))
    picture = f"{base}/walls/{wall.id}/picture{version}"
    return _Preview(wall.name, line, picture, plain.listed, tier)


def _key(text: str) -> UUID | None:
    try:
        return UUID(text)
    except ValueError:
        return None
