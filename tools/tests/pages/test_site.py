"""The site of the documentation: it builds, links lead somewhere, nothing is from elsewhere."""

from __future__ import annotations

import functools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import tomllib
from collections.abc import Callable, Iterator
from contextlib import suppress
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import NoReturn
from urllib.parse import unquote, urlsplit

import pytest
from tools.pages.commands import leaves
from tools.pages.staging import stage

from walltopo.cli import build_parser
from walltopo.pipeline.settings import sections

ROOT = Path(__file__).parents[3]
# Limits: a visit of the first page, and each picture and film of the leading pages.
MAX_FIRST_BYTES = 500_000
MAX_PICTURE_BYTES = 500_000
MAX_FILM_BYTES = 3_000_000
# Looked at by axe, as the main pages.
MAIN = ("./", "setter/", "developer/", "researcher/")
TUTORIALS = ("setter", "setter.de", "setter.cs", "setter.fr", "developer", "researcher", "operator")


class Page(HTMLParser):
    """The links of a page, the files that it loads, and the anchors in it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.places |= {given[name] for name in ("id", "name") if name in given}
        target = given.get("src") or given.get("href")
        if not target or given.get("rel") in ("canonical", "next", "prev"):
            return
        (self.links if tag == "a" else self.loads).append(target)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site, made beside the checkout so that nothing is left in it."""
    root = tmp_path_factory.mktemp("site")
    stage(ROOT, root / "build" / "site")
    shutil.copyfile(ROOT / "zensical.toml", root / "zensical.toml")
    for folder in ("src", "tools"):
        (root / folder).symlink_to(ROOT / folder)
    done = subprocess.run(
        [Path(sys.executable).parent / "zensical", "build", "--strict"],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return root / "site"


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    found = {path: Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    return {path: page for path, page in found.items() if path.name != "404.html"}


def leads_to(page: Path, target: str) -> Path:
    """The file that a link of a page leads to."""
    path = (page.parent / unquote(urlsplit(target).path)).resolve()
    return path / "index.html" if path.is_dir() else path


def foreign(target: str) -> bool:
    return bool(urlsplit(target).scheme or urlsplit(target).netloc)


@pytest.mark.slow
def test_every_link_leads_somewhere(pages: dict[Path, Page]) -> None:
    """Pages, places in them, pictures, records, schemas."""
    broken = []
    for path, page in pages.items():
        for target in {*page.links, *page.loads}:
            if foreign(target) or not target:
                continue
            file = leads_to(path, target) if urlsplit(target).path else path
            place = unquote(urlsplit(target).fragment)
            if not file.is_file():
                broken.append(f"{path.parent.name}: {target}")
            elif place and file in pages and place not in pages[file].places:
                broken.append(f"{path.parent.name}: {target} (no such place)")
    assert len(pages) > 40
    assert broken == []


@pytest.mark.slow
def test_nothing_is_loaded_from_another_host(pages: dict[Path, Page]) -> None:
    assert [target for page in pages.values() for target in page.loads if foreign(target)] == []


@pytest.mark.slow
def test_the_first_page_is_small(site: Path, pages: dict[Path, Page]) -> None:
    first = site / "index.html"
    files = {leads_to(first, target) for target in pages[first].loads} | {first}
    assert sum(file.stat().st_size for file in files) <= MAX_FIRST_BYTES


@pytest.mark.parametrize("name", TUTORIALS)
def test_the_pictures_of_a_tutorial_are_small(
    site: Path, pages: dict[Path, Page], name: str
) -> None:
    path = site / name / "index.html"
    files = {leads_to(path, target) for target in pages[path].loads}
    pictures = [file for file in files if file.suffix in (".jpg", ".png", ".webp")]
    assert sum(file.stat().st_size for file in pictures) <= MAX_PICTURE_BYTES


@pytest.mark.slow
def test_every_page_can_be_reached(site: Path, pages: dict[Path, Page]) -> None:
    reached, ahead = set(), [site / "index.html"]
    while ahead:
        path = ahead.pop()
        reached.add(path)
        links = {urlsplit(link).path for link in pages[path].links if not foreign(link)}
        near = {leads_to(path, link) for link in links if link}
        ahead += [file for file in near if file in pages and file not in reached]
    assert {path.parent.name for path in pages} - {path.parent.name for path in reached} == set()


def test_every_page_of_the_navigation_is_there(site: Path) -> None:
    text = (ROOT / "zensical.toml").read_text(encoding="utf-8")
    named = re.findall(
        r'"([\w.-]+)\.md"', str(tomllib.loads(text)["project"]["nav"]).replace("'", '"')
    )
    assert len(named) > 40
    assert [n for n in named if n != "index" and not (site / n / "index.html").is_file()] == []


def test_every_option_and_setting_is_on_it(site: Path) -> None:
    commands = (site / "commands" / "index.html").read_text(encoding="utf-8")
    options = {
        option
        for _, parser in leaves(build_parser())
        for action in parser._actions
        for option in action.option_strings
        if option.startswith("--") and option != "--help"
    }
    assert len(options) > 100
    assert [option for option in options if f"<code>{option}" not in commands] == []
    settings = (site / "settings" / "index.html").read_text(encoding="utf-8")
    keys = [key for fields in sections().values() for key in fields]
    assert [key for key in keys if f"<code>{key}</code>" not in settings] == []
    gym = pytest.importorskip("walltopo_gym.settings").GymSettings.model_fields
    shown = (site / "gym-settings" / "index.html").read_text(encoding="utf-8")
    assert [name for name in gym if f"<code>{name}</code>" not in shown] == []


def test_the_film_is_small() -> None:
    assert 100_000 < (ROOT / "docs" / "pictures" / "film.webp").stat().st_size <= MAX_FILM_BYTES


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *args: object) -> None:
        """Nothing: the tests' output is for failures."""


@pytest.fixture
def address(site: Path) -> Iterator[str]:
    """The site on a server, as visitors have it."""
    handler = functools.partial(Quiet, directory=str(site))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.mark.slow
def test_main_pages_are_for_everybody(address: str, lacks: Callable[[str], NoReturn]) -> None:
    """WCAG 2.2 AA by axe, in light and dark, wide and narrow; no request to other hosts."""
    viewer = ROOT / "viewer"
    if shutil.which("chromium") is None or not (viewer / "node_modules" / "axe-core").is_dir():
        lacks("Chromium, or the viewer's node_modules (make browser)")
    browser = subprocess.Popen(
        ["node", "tests/site.mjs", address, *MAIN],
        cwd=viewer,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        shown, errors = browser.communicate(timeout=1800)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(browser.pid, signal.SIGKILL)
        browser.wait()
    looked = [json.loads(line) for line in shown.splitlines()]
    assert len(looked) == 2 * len(MAIN), errors
    assert min(look["passed"] for look in looked) > 15
    assert [look for look in looked if look["wrong"] or look["foreign"]] == []
