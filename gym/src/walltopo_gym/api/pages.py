"""The web app: its files, and its page with what a link's preview is made of.

Built files lie in `walltopo_gym/web` (`make app`). Those below `/assets/` have their content's hash
in their name and are cached for ever; the page itself is asked for each time.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Final

from fastapi import APIRouter, Request, Response
from starlette.responses import HTMLResponse, RedirectResponse

from walltopo.core import EnvironmentLacksError
from walltopo.publish.web_page import viewer_script
from walltopo_gym.api.link_previews import head_of
from walltopo_gym.api.services import ServicesOf
from walltopo_gym.errors import NotFoundError
from walltopo_gym.hall.codes import route_by_code

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
    "img-src 'self' blob: data:; connect-src 'self' blob:; worker-src 'self'; "
    "manifest-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors "
)

_WORKER_POLICY: Final = (
    "default-src 'none'; script-src 'wasm-unsafe-eval'; connect-src 'self' blob:; "
    "frame-ancestors 'none'"
)

# The first part of each address of the app (gym/web/src/routes.ts).
_PLACES: Final = {
    "", "embed", "g", "invitation", "kiosk", "me", "new-gym", "new-password", "people", "r",
    "sign-in", "sign-up", "unsubscribe",
}  # fmt: skip


@dataclass(frozen=True)
class _Asset:
    """A file as it is sent."""

    content: bytes
    packed: bytes
    kind: str


def _asset(path: Path) -> _Asset:
    content = path.read_bytes()
    kind = mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return _Asset(content, gzip.compress(content, 9, mtime=0), kind)


@cache
def _assets() -> dict[str, _Asset]:
    """The app's files by address.

    Raises
    ------
    EnvironmentLacksError : the app was not built.
    """
    folder = Path(str(_FOLDER))
    if not (folder / "index.html").is_file():
        raise EnvironmentLacksError("the web app is not built", "Run `make app`.")
    found = {
        f"/{path.relative_to(folder).as_posix()}": _asset(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    return found | {_viewer(): _asset(viewer_script())}


@cache
def _viewer() -> str:
    """Address of the script that defines `<wall-topo>`."""
    digest = hashlib.sha256(viewer_script().read_bytes()).hexdigest()
    return f"/assets/viewer-{digest[:12]}.js"


@router.api_route("/assets/{name}", methods=_READING)
def read_asset(name: str, request: Request) -> Response:
    """A file that never changes under its name."""
    answer = _sent(f"/assets/{name}", request, _FOR_EVER)
    if request.url.path == _viewer():
        answer.headers["content-security-policy"] = _WORKER_POLICY
    return answer


@router.api_route("/{name}.webmanifest", methods=_READING)
@router.api_route("/{name}.png", methods=_READING)
@router.api_route("/{name}.svg", methods=_READING)
@router.api_route("/{name}.js", methods=_READING)
def read_loose_file(request: Request) -> Response:
    """What browsers want under a fixed name: manifest, icons, service worker."""
    answer = _sent(request.url.path, request, "no-cache")
    # The service worker's own policy: it fetches what it keeps.
    answer.headers["content-security-policy"] = "default-src 'none'; connect-src 'self'"
    return answer


@router.api_route("/r/{code}", methods=_READING, response_class=HTMLResponse)
def read_short_address(code: str, request: Request, services: ServicesOf) -> Response:
    """On to the route that has this address now; of a private gym only the app can know it."""
    with services.database.reading() as session:
        try:
            gym, route = route_by_code(session, code)
        except NotFoundError:
            return read_page(f"r/{code}", request, services)
    if gym.visibility == "private":
        return read_page(f"r/{code}", request, services)
    place = f"/g/{gym.slug}/w/{route.wall_id}/r/{route.id}"
    # Not for ever: the route may come to hang on another wall.
    return RedirectResponse(place, 302, {"cache-control": "no-cache"})


@router.api_route("/{place:path}", methods=_READING, response_class=HTMLResponse)
def read_page(place: str, request: Request, services: ServicesOf) -> Response:
    """The app, which finds by the address what to show; framed by others below `/embed` alone."""
    first, _, rest = place.partition("/")
    if first in ("api", "health", "ready"):
        raise NotFoundError("no such endpoint")
    is_embedded = first == "embed"
    shown = rest if is_embedded else place
    head = head_of(services, shown, _viewer(), indexed=not is_embedded)
    page = _assets()["/index.html"].content.decode().replace(_MARK, head)
    policy = _POLICY + ("*" if is_embedded else "'none'")
    headers = {"content-security-policy": policy, "cache-control": "private, no-cache"}
    return HTMLResponse(page, 200 if first in _PLACES else 404, headers)


def _sent(address: str, request: Request, caching: str) -> Response:
    found = _assets().get(address)
    if found is None:
        raise NotFoundError("no such file")
    headers = {"cache-control": caching, "vary": "accept-encoding"}
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return Response(found.content, headers=headers, media_type=found.kind)
    headers["content-encoding"] = "gzip"
    return Response(found.packed, headers=headers, media_type=found.kind)
