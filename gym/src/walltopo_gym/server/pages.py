"""The web app: its files, and its page with the tags of a link's preview (https://ogp.me).

Built files lie in `walltopo_gym/web` (`make app`). Those below `/assets/` have their content's hash
in their name and are cached for ever; the page itself is requested each time. A preview shows
public facts only: nothing of a private gym.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Final
from urllib.parse import urlencode
from uuid import UUID

from fastapi import APIRouter, Request, Response
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.responses import HTMLResponse, RedirectResponse

from walltopo.core import EnvironmentLacksError
from walltopo.publish.web_page import viewer_script
from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.lookup import gym_by_slug
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.codes import route_by_code
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.scans.pictures import HEIGHT, WIDTH
from walltopo_gym.walls.models import Wall

router = APIRouter(include_in_schema=False)

_READING: Final = ["GET", "HEAD"]

_FOLDER: Final = files("walltopo_gym") / "web"

_MARK: Final = "<!--head-->"

_FOR_EVER: Final = "public, max-age=31536000, immutable"

# No script and no style but our own files. The wall's decoder is WebAssembly; its workers run the
# viewer's own script once more, under the policy that comes with that: a wall's pictures are read
# there.
_POLICY: Final = (
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; "
    "img-src 'self' blob: data:; media-src 'self' blob:; connect-src 'self' blob:; "
    "worker-src 'self'; "
    "manifest-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors "
)

_WORKER_POLICY: Final = (
    "default-src 'none'; script-src 'wasm-unsafe-eval'; connect-src 'self' blob:; "
    "frame-ancestors 'none'"
)

# The first part of each address of the app (gym/web/src/routes.ts).
_PLACES: Final = {
    "",
    "embed",
    "g",
    "invitation",
    "judge",
    "kiosk",
    "me",
    "new-gym",
    "new-password",
    "oauth",
    "operator",
    "people",
    "r",
    "selftest",
    "setup",
    "sign-in",
    "sign-up",
    "unsubscribe",
    "verify",
}

# First parts of addresses that programs alone use.
_NO_PAGES: Final = {".well-known", "api", "health", "mcp", "oembed", "ready"}


@dataclass(frozen=True)
class _Asset:
    """A file as it is sent."""

    content: bytes
    packed: bytes
    kind: str


def _read_asset(path: Path) -> _Asset:
    content = path.read_bytes()
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return _Asset(content, gzip.compress(content, 9, mtime=0), kind)


@cache
def _assets() -> dict[str, _Asset]:
    """Return the app's files by address.

    Raises
    ------
    EnvironmentLacksError : the app was not built.
    """
    folder = Path(str(_FOLDER))
    if not (folder / "index.html").is_file():
        raise EnvironmentLacksError("the web app is not built", "In a checkout, run `make web`.")
    found = {
        f"/{path.relative_to(folder).as_posix()}": _read_asset(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    return found | {_viewer(): _read_asset(viewer_script())}


@cache
def _viewer() -> str:
    """Return the address of the script that defines `<wall-topo>`."""
    digest = hashlib.sha256(viewer_script().read_bytes()).hexdigest()
    return f"/assets/viewer-{digest[:12]}.js"


@router.api_route("/assets/{name}", methods=_READING)
def read_asset(name: str, request: Request) -> Response:
    """Return a file whose content never changes under its name."""
    answer = _send_asset(f"/assets/{name}", request, _FOR_EVER)
    if request.url.path == _viewer():
        answer.headers["content-security-policy"] = _WORKER_POLICY
    return answer


@router.api_route("/{name}.webmanifest", methods=_READING)
@router.api_route("/{name}.png", methods=_READING)
@router.api_route("/{name}.svg", methods=_READING)
@router.api_route("/{name}.js", methods=_READING)
def read_loose_file(request: Request) -> Response:
    """Return a file with a fixed name: manifest, icons, service worker."""
    answer = _send_asset(request.url.path, request, "no-cache")
    # The service worker's own policy: it fetches what it keeps.
    answer.headers["content-security-policy"] = "default-src 'none'; connect-src 'self'"
    return answer


@router.api_route("/r/{code}", methods=_READING, response_class=HTMLResponse)
def read_short_address(code: str, request: Request, services: ServicesOf) -> Response:
    """Redirect to the route of a short address; the app resolves those of private gyms."""
    if "hall" not in services.settings.features:
        raise NotFoundError("not-there-endpoint")
    with services.database.reading() as session:
        try:
            gym, route = route_by_code(session, code)
        except NotFoundError:
            return read_page(f"r/{code}", request, services)
    if gym.visibility == "private":
        return read_page(f"r/{code}", request, services)
    path = f"/g/{gym.slug}/w/{route.wall_id}/r/{route.id}"
    # Not for ever: the route may come to hang on another wall.
    return RedirectResponse(path, 302, {"cache-control": "no-cache"})


@router.api_route("/{place:path}", methods=_READING, response_class=HTMLResponse)
def read_page(place: str, request: Request, services: ServicesOf) -> Response:
    """Return the app's page; only pages below `/embed` may be framed by other sites."""
    first, _, rest = place.partition("/")
    if first in _NO_PAGES:
        raise NotFoundError("not-there-endpoint")
    is_embedded = first == "embed"
    shown = rest if is_embedded else place
    head = head_of(services, shown, _viewer(), indexed=not is_embedded)
    page = _assets()["/index.html"].content.decode().replace(_MARK, head)
    policy = _POLICY + ("*" if is_embedded else "'none'")
    headers = {"content-security-policy": policy, "cache-control": "private, no-cache"}
    return HTMLResponse(page, 200 if first in _PLACES else 404, headers)


def _send_asset(address: str, request: Request, caching: str) -> Response:
    found = _assets().get(address)
    if found is None:
        raise NotFoundError("not-there-file")
    headers = {"cache-control": caching, "vary": "accept-encoding"}
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return Response(found.content, headers=headers, media_type=found.kind)
    headers["content-encoding"] = "gzip"
    return Response(found.packed, headers=headers, media_type=found.kind)


_SITE = "walltopo"


@dataclass(frozen=True)
class Preview:
    """Title, description, and the addresses of a picture and of a wall's first tier; empty if
    missing."""

    title: str
    line: str = ""
    picture: str = ""
    listed: bool = True
    tiers: tuple[str, ...] = ()


def head_of(services: Services, path: str, viewer: str, *, indexed: bool) -> str:
    """Return the HTML of a page's title and tags.

    Parameters
    ----------
    path : path of the page, without a leading slash.
    viewer : address of the viewer's script.
    indexed : whether search engines may index the page.
    """
    parts = path.strip("/").split("/")
    with services.database.reading() as session:
        shown = preview_of(session, parts)
    base = services.settings.link_base
    tags = [f"<title>{escape(shown.title)}</title>"]
    if not (indexed and shown.listed):
        tags.append('<meta name="robots" content="noindex">')
    meta = {"site_name": _SITE, "type": "website", "title": shown.title, "url": f"{base}/{path}"}
    if shown.line:
        meta["description"] = shown.line
    if shown.picture:
        meta |= {
            "image": base + shown.picture,
            "image:width": str(WIDTH),
            "image:height": str(HEIGHT),
        }
        tags.append('<meta name="twitter:card" content="summary_large_image">')
    tags += [f'<meta property="og:{name}" content="{escape(text)}">' for name, text in meta.items()]
    if shown.picture:
        tags.append(_discovery_tag(f"{base}/{path}", base, shown.title))
    tags.append(f'<meta name="wall-viewer" content="{viewer}">')
    tags.append(f'<meta name="features" content="{" ".join(services.settings.features)}">')
    if shown.tiers:
        # The app finds out only after some questions that it wants them; its own scripts go first.
        early = '<link rel="preload" fetchpriority="low" as='
        tags.append(f'{early}"script" href="{viewer}">')
        tags += [f'{early}"fetch" crossorigin href="{tier}">' for tier in shown.tiers]
    return "".join(tags)


def _discovery_tag(address: str, base: str, title: str) -> str:
    """Return the tag by which other sites find how to embed a wall (https://oembed.com)."""
    target = f"{base}/oembed?{urlencode({'url': address, 'format': 'json'})}"
    kind = 'rel="alternate" type="application/json+oembed"'
    return f'<link {kind} href="{escape(target)}" title="{escape(title)}">'


def preview_of(session: Session, parts: list[str]) -> Preview:
    """Return the preview of the gym, wall or route in the path, as far as it exists."""
    match parts:
        case ["g", slug, *rest]:
            gym = gym_by_slug(session, slug)
            if gym is not None and gym.visibility != "private":
                return _of_gym(session, gym, rest)
    return Preview(_SITE)


def _of_gym(session: Session, gym: Gym, rest: list[str]) -> Preview:
    plain = Preview(gym.name, gym.place, listed=gym.visibility == "public")
    if len(rest) < 2 or rest[0] != "w":
        return plain
    wall = session.get(Wall, key) if (key := _key(rest[1])) else None
    if wall is None or wall.gym_id != gym.id:
        return plain
    base = f"/api/v1/gyms/{gym.slug}"
    version = ""
    tiers: tuple[str, ...] = ()
    if wall.published_scan_id is not None:
        version = f"?v={wall.published_scan_id.hex[:8]}"
        files = f"{base}/scans/{wall.published_scan_id}/files/page"
        tiers = (f"{files}/first.glb", f"{files}/labels.json")
    picture = f"{base}/walls/{wall.id}/picture{version}" if version else ""
    if len(rest) >= 4 and rest[2] == "r" and (key := _key(rest[3])):
        route = session.get(Route, key)
        if route is not None and route.wall_id == wall.id:
            title = " ".join(filter(None, (route.name or route.colour, route.grade)))
            line = " · ".join(filter(None, (wall.name, gym.name, route.setter)))
            shown = select(Placement.number).where(
                Placement.route_id == route.id, Placement.scan_id == wall.published_scan_id
            )
            if session.scalar(shown) is not None:
                picture = f"{base}/routes/{route.id}/picture{version}"
            return Preview(title, line, picture, plain.listed, tiers)
    line = " · ".join(filter(None, (gym.name, gym.place)))
    return Preview(wall.name, line, picture, plain.listed, tiers)


def _key(text: str) -> UUID | None:
    try:
        return UUID(text)
    except ValueError:
        return None
