"""The app as the server sends it: policy, caching, previews of links; that it is of its source."""

from __future__ import annotations

import gzip
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, NoReturn

import httpx
import pytest
from gym.tests.worlds import ORIGIN, Server, World, hold, make_world
from PIL import Image

from walltopo.pipeline.stages import stage_names
from walltopo_gym.scans.pictures import HEIGHT, WIDTH, route_picture, wall_picture
from walltopo_gym.server import document
from walltopo_gym.server.app import PREFIX

ROOT = Path(__file__).resolve().parents[3]
WEB = ROOT / "gym" / "web"
BUILT = ROOT / "gym" / "src" / "walltopo_gym" / "web"
# The app's own words, and those of areas that come with their pages.
LOCALES = sorted((WEB / "src").glob("**/locales"))
# Plural forms of whole numbers and fractions (CLDR).
FORMS = {
    "en": {"one", "other"},
    "de": {"one", "other"},
    "cs": {"one", "few", "many", "other"},
    "fr": {"one", "many", "other"},
}


def page(server: Server, path: str) -> httpx.Response:
    """A page as a messenger asks for it: nobody is signed in."""
    return server.client().get(path)


def meta_tags(text: str) -> dict[str, str]:
    """Return a page's Open Graph tags."""
    return dict(re.findall(r'<meta property="og:([\w:]+)" content="([^"]*)">', text))


@pytest.fixture
def current(server: Server) -> World:
    """A public gym with a published wall, named to break out of the page."""
    world = make_world(server, visibility="public")
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    world.publish(scan, {"number": 1, "name": '"><script>alert(1)</script>', "setter": "Jana"})
    return world


def test_the_policy_lets_in_our_own_files_alone(server: Server) -> None:
    headers = page(server, "/").headers
    policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == "'self' 'wasm-unsafe-eval'"
    assert policy["style-src"] == "'self'"
    assert policy["connect-src"] == "'self' blob:"
    assert policy["frame-ancestors"] == "'none'"
    assert "http" not in headers["content-security-policy"]
    assert headers["cache-control"] == "private, no-cache"


def test_others_may_frame_what_is_for_that(server: Server, current: World) -> None:
    answer = page(server, f"/embed/g/{current.gym.slug}/w/{current.wall.id}")
    assert answer.headers["content-security-policy"].endswith("frame-ancestors *")
    assert "noindex" in answer.text


def test_a_page_has_no_script_or_style_within(server: Server) -> None:
    text = page(server, "/").text
    assert re.findall(r"<script(?![^>]*\bsrc=)", text) == []
    assert "<style" not in text
    assert " style=" not in text


def test_files_are_cached_for_ever_and_the_page_is_not(server: Server) -> None:
    text = page(server, "/").text
    scripts = re.findall(r'(?:src|href|content)="(/assets/[^"]+)"', text)
    assert any("viewer" in script for script in scripts)
    for script in scripts:
        answer = server.client().get(script)
        assert answer.status_code == 200
        assert "immutable" in answer.headers["cache-control"]
        plain = server.client().get(script, headers={"accept-encoding": "identity"})
        assert plain.content == answer.content
        assert "content-encoding" not in plain.headers
    assert server.client().get("/sw.js").headers["cache-control"] == "no-cache"
    for name in ("/app.webmanifest", "/icon.svg", "/icon-192.png", "/icon-512.png"):
        assert server.client().get(name).status_code == 200
    assert server.client().head("/").status_code == 200


def test_missing_pages_answer_people_and_programs(server: Server) -> None:
    assert page(server, "/wp-login.php").status_code == 404
    assert "<div id=" in page(server, "/no/such/page").text
    assert "<div id=" in page(server, "/assets/..%2f..%2fapi%2fapp.py").text
    for path in ("/assets/none.js", "/none.png", "/api/v1/none"):
        answer = page(server, path)
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"


def test_a_link_to_a_route_says_what_it_is(server: Server, current: World) -> None:
    route = current.published()["routes"][0]["id"]
    path = f"/g/{current.gym.slug}/w/{current.wall.id}/r/{route}"
    text = page(server, path).text
    tags = meta_tags(text)
    assert "<script>alert" not in text
    assert tags["title"] == "&quot;&gt;&lt;script&gt;alert(1)&lt;/script&gt;"
    assert tags["url"] == ORIGIN + path
    assert current.wall.name in tags["description"]
    assert "Jana" in tags["description"]
    assert f"/routes/{route}/picture" in tags["image"]
    assert "noindex" not in text


def test_a_wall_comes_while_the_app_does(server: Server, current: World) -> None:
    wall = f"g/{current.gym.slug}/w/{current.wall.id}"
    published = current.published()
    for path in (f"/{wall}", f"/{wall}/r/{published['routes'][0]['id']}", f"/embed/{wall}"):
        early = re.findall(r'<link rel="preload"[^>]* href="([^"]+)"', page(server, path).text)
        viewer, tier, labels = early
        assert server.client().get(viewer).status_code == 200
        # `filesOf` of the app and `src` of its wall make the same address.
        files = f"{PREFIX}{current.path}/scans/{published['scan_id']}/files/page"
        assert (tier, labels) == (f"{files}/first.glb", f"{files}/labels.json")
    assert 'rel="preload"' not in page(server, f"/g/{current.gym.slug}").text


def test_a_private_gym_has_no_preview(server: Server, world: World) -> None:
    text = page(server, f"/g/{world.gym.slug}/w/{world.wall.id}").text
    assert 'rel="preload"' not in text
    assert world.gym.name not in text
    assert meta_tags(text)["title"] == "walltopo"


def test_odd_addresses_are_pages(server: Server, current: World) -> None:
    for path in ("w/none", f"w/{current.wall.id}/r/none", f"w/{current.wall.id}/r", "w", "x/y/z"):
        assert page(server, f"/g/{current.gym.slug}/{path}").status_code == 200


@pytest.mark.slow
def test_pictures_of_a_real_scan(server: Server, tiny_scan: Path) -> None:
    """Only the route keeps its colour, and its holds are in the middle of the picture."""
    world = make_world(server, visibility="public")
    scan = world.finished(tiny_scan)
    store = server.services.store
    whole = Image.open(BytesIO(wall_picture(store, scan)))
    assert whole.size == (WIDTH, HEIGHT)
    routes = json.loads((tiny_scan / "routes.json").read_text())["routes"]
    colours = json.loads((tiny_scan / "holds.json").read_text())
    assert colours
    for route in routes:
        drawn = Image.open(BytesIO(route_picture(store, scan, route["holds"]))).convert("HSV")
        saturated = [
            drawn.getpixel((x, y)) for x in range(0, WIDTH, 6) for y in range(0, HEIGHT, 6)
        ]
        share = sum(pixel[1] > 90 for pixel in saturated if isinstance(pixel, tuple))
        assert share < 0.5 * len(saturated)


# The build ------------------------------------------------------------------------------------


def keys(words: dict[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Each text with its dotted place."""
    for name, value in words.items():
        if isinstance(value, dict):
            yield from keys(value, f"{before}{name}.")
        else:
            yield before + name, value


@pytest.mark.parametrize("code", sorted(FORMS))
@pytest.mark.parametrize("folder", LOCALES, ids=lambda folder: folder.parent.name)
def test_every_language_says_everything(folder: Path, code: str) -> None:
    plural = re.compile(r"_(one|few|many|other)$")
    english = dict(keys(json.loads((folder / "en.json").read_text())))
    here = dict(keys(json.loads((folder / f"{code}.json").read_text())))
    assert all(text.strip() for text in here.values())
    wanted = set()
    for key in english:
        forms = FORMS[code] if plural.search(key) else [""]
        wanted |= {plural.sub("", key) + (f"_{form}" if form else "") for form in forms}
    assert set(here) == wanted
    for key, text in here.items():
        model = english.get(key) or english[plural.sub("_other", key)]
        slots = set(re.findall(r"{{(\w+)}}", text))
        assert slots - {"count"} == set(re.findall(r"{{(\w+)}}", model)) - {"count"}, key


def test_every_stage_has_words() -> None:
    """In the order in which they run; their texts are the languages' test."""
    listed = re.findall(r'^  ("\w+".*),$', (WEB / "src/scans/stages.ts").read_text(), re.M)
    assert re.findall(r'"(\w+)"', " ".join(listed)) == list(stage_names())


def test_the_shell_is_small() -> None:
    """No page loads more than 120 kB (gzip) of JavaScript, not counting the viewer, nor the
    sentences of server errors, which come after it."""
    folder = BUILT / "assets"
    sizes = {path.name: len(gzip.compress(path.read_bytes(), 9)) for path in folder.glob("*.js")}

    def loaded(name: str, seen: set[str]) -> set[str]:
        """A script with all that it imports when it begins."""
        if name not in seen:
            seen.add(name)
            text = (folder / name).read_text()
            for found in re.findall(r'(?:from|import) ?"\./([\w.-]+\.js)"', text):
                loaded(found, seen)
        return seen

    def later(scripts: set[str]) -> set[str]:
        """Modules that scripts import on demand."""
        texts = "".join((folder / name).read_text() for name in scripts)
        return set(re.findall(r'import\([`"]\./([\w.-]+\.js)[`"]\)', texts))

    def heaviest(scripts: set[str], *, with_area: bool) -> int:
        """Return the size of the largest language: words of the app, and those of the largest area
        for a page that has words of its own. A page loads only one language."""
        words = {name for name in later(scripts) if re.match(r"(en|de|cs|fr)-", name)}
        errors = {name for name in words if "id-taken" in (folder / name).read_text()}
        assert len(errors) == 3  # the server answers in English itself
        words -= errors
        common = {name for name in words if "skip:" in (folder / name).read_text()}
        spoken = {name[:2] for name in words}
        assert len(spoken) == 4
        assert len(common) == 4

        def size(code: str) -> int:
            mine = {name for name in words if name.startswith(code)}
            area = max(sizes[name] for name in mine - common) if with_area else 0
            return sum(sizes[name] for name in mine & common) + area

        return max(size(code) for code in spoken)

    page = (BUILT / "index.html").read_text()
    entries = re.findall(r"/assets/([\w.-]+\.js)", page)
    shell = set().union(*(loaded(entry, set()) for entry in entries))
    pages = {name for name in later(shell) if not re.match(r"(en|de|cs|fr)-", name)}
    of_page = {name: loaded(name, set(shell)) for name in pages}
    texts = "".join((folder / name).read_text() for name in shell)
    of_area = pages & set(re.findall(r"import\(`\./([\w.-]+\.js)`\)\.then", texts))
    assert 10 < len(of_area) < len(pages)
    whole = {
        name: sum(sizes[part] for part in parts) + heaviest(parts, with_area=name in of_area)
        for name, parts in of_page.items()
    }
    assert len(pages) > 15
    assert {name: size for name, size in whole.items() if size > 120_000} == {}
    assert max(whole.values()) > 60_000


@pytest.fixture
def node(lacks: Callable[[str], NoReturn]) -> Path:
    """The folder of the app's tools."""
    if shutil.which("node") is None or not (WEB / "node_modules").is_dir():
        lacks("node or gym/web/node_modules is missing (make browser)")
    return WEB / "node_modules" / ".bin"


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@pytest.mark.slow
def test_the_apps_types_fit_the_present_api(node: Path, tmp_path: Path) -> None:
    """They are made of the server's document, and the whole app is checked by them."""
    document_file, out = tmp_path / "openapi.json", WEB / "src" / "api" / "schema.d.ts"
    document.write_document(document_file)
    words = [str(document_file), "--default-non-nullable=false", "--output", str(out)]
    subprocess.run([str(node / "openapi-typescript"), *words], cwd=WEB, check=True, timeout=900)
    check = [str(node / "svelte-check"), "--tsconfig", "./tsconfig.json", "--fail-on-warnings"]
    done = subprocess.run(check, cwd=WEB, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stdout[-3000:]
