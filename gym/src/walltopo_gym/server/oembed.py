"""How other sites embed a wall or a route by its address (https://oembed.com)."""

from __future__ import annotations

from html import escape
from typing import Annotated, Any, Final
from urllib.parse import urlsplit

from fastapi import APIRouter, HTTPException, Query
from starlette.responses import JSONResponse

from walltopo_gym.api.services import ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.scans.pictures import HEIGHT, WIDTH
from walltopo_gym.server.pages import Preview, preview_of

router = APIRouter(include_in_schema=False)

_WIDTH: Final = 800  # pixels
_HEIGHT: Final = 600
# Shorter than the caches of pages: a gym may become private.
_CACHE_S: Final = 3600

_UNLIMITED: Final = 10_000
_Pixels = Annotated[int, Query(ge=100, le=_UNLIMITED)]


@router.get("/oembed")
def read_oembed(
    services: ServicesOf,
    url: Annotated[str, Query(max_length=1000)],
    format: Annotated[str, Query(max_length=10)] = "json",
    maxwidth: _Pixels = _UNLIMITED,
    maxheight: _Pixels = _UNLIMITED,
) -> JSONResponse:
    """Return the frame that shows a wall or a route. Private gyms are not found."""
    if format != "json":
        raise HTTPException(501, "only format=json is available")
    base = services.settings.link_base
    path = _wall_path(base, url)
    with services.database.reading() as session:
        shown = preview_of(session, path.split("/"))
    if not shown.picture:  # private, unknown, or nothing is published
        raise NotFoundError("not-found")
    size = min(_WIDTH, maxwidth), min(_HEIGHT, maxheight)
    body = _frame_markup(base, path, shown, size)
    if maxwidth >= WIDTH and maxheight >= HEIGHT:
        picture = {"url": base + shown.picture, "width": WIDTH, "height": HEIGHT}
        body |= {f"thumbnail_{name}": value for name, value in picture.items()}
    return JSONResponse(body, headers={"cache-control": f"public, max-age={_CACHE_S}"})


def _wall_path(base: str, url: str) -> str:
    """Return the path of a wall's or route's page, without a leading slash.

    Raises
    ------
    NotFoundError : the address is another one.
    """
    if not url.startswith(f"{base}/"):
        raise NotFoundError("not-found")
    try:
        path = urlsplit(url.removeprefix(base)).path.strip("/")
    except ValueError as error:
        raise NotFoundError("not-found") from error
    match path.split("/"):
        case ["g", _, "w", _] | ["g", _, "w", _, "r", _]:
            return path
    raise NotFoundError("not-found")


def _frame_markup(base: str, path: str, shown: Preview, size: tuple[int, int]) -> dict[str, Any]:
    width, height = size
    source = escape(f"{base}/embed/{path}")
    frame = (
        f'<iframe src="{source}" title="{escape(shown.title)}" width="{width}" height="{height}" '
        'loading="lazy" allowfullscreen style="border:0"></iframe>'
    )
    return {
        "version": "1.0",
        "type": "rich",
        "title": shown.title,
        "author_name": shown.line,
        "provider_name": "walltopo",
        "provider_url": base,
        "cache_age": _CACHE_S,
        "html": frame,
        "width": width,
        "height": height,
    }
