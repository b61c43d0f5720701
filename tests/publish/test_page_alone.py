"""The exported page: one file from disk, a folder on a web host that knows nothing of it."""

from __future__ import annotations

import functools
import http.server
import json
import re
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from test_viewer_browser import VIEWER, missing  # type: ignore[import-not-found]

from walltopo.cli import main
from walltopo.publish.web_page import write_single_page
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


@pytest.fixture
def scan(make_scan: MakeScan) -> ScanFolder:
    return make_scan("gym", holds=4, cells=24)


@contextmanager
def any_host(folder: Path) -> Iterator[str]:
    """The plainest web server there is."""
    handler = functools.partial(_Silent, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


class _Silent(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None: ...


def test_the_page_is_one_file(scan: ScanFolder, tmp_path: Path) -> None:
    out = tmp_path / "only" / "wall.html"
    assert main(["export", str(scan.root), "--format", "page", "-o", str(out)]) == 0
    assert [path.name for path in out.parent.iterdir()] == ["wall.html"]
    text = out.read_text(encoding="utf-8")
    requests = re.findall(
        r'<(?:script|link|wall-topo)[^>]* (?:src|href|detail)="([^"]{0,12})', text
    )
    assert requests
    assert all(start.startswith("data:") for start in requests)


def test_the_site_needs_nothing_beside_it(scan: ScanFolder, tmp_path: Path) -> None:
    out = tmp_path / "site"
    for _ in range(2):  # again replaces its own files
        assert main(["export", str(scan.root), "--format", "site", "-o", str(out)]) == 0
    named = re.findall(r'"(page/[^"]+)"', (out / "index.html").read_text(encoding="utf-8"))
    assert set(named) == {
        f"page/{name}" for name in ("start.js", "viewer.js", "first.glb", "detail.glb")
    }
    assert all((out / name).is_file() for name in named)


@pytest.mark.parametrize("kind", ["page", "site"])
def test_a_page_leaves_foreign_files_alone(scan: ScanFolder, kind: str, tmp_path: Path) -> None:
    out = tmp_path / ("wall.html" if kind == "page" else "web")
    taken = out if kind == "page" else out / "index.html"
    taken.parent.mkdir(exist_ok=True)
    taken.write_text("mine")
    assert main(["export", str(scan.root), "--format", kind, "-o", str(out)]) == 3
    assert taken.read_text() == "mine"


def test_nothing_in_the_script_ends_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = tmp_path / "viewer.js"
    script.write_text('const a = "</script><!--<SCRIPT>", b = /<\\/script/, c = 1 < 2;')
    monkeypatch.setattr("walltopo.publish.web_page.viewer_script", lambda: script)
    write_single_page(tmp_path / "p.html", "<b>Owl</b>", b"1", b"2")
    text = (tmp_path / "p.html").read_text()
    code = text.split("<script>")[1].split("</script>")[0]
    assert code == ('const a = "\\x3c/script>\\x3c!--\\x3cSCRIPT>", b = /<\\/script/, c = 1 < 2;')
    assert "<b>" not in text


@pytest.mark.slow
@pytest.mark.skipif(bool(missing()), reason=f"browser tests: {missing()}")
def test_both_open_in_a_browser(scan: ScanFolder, tmp_path: Path) -> None:
    page, site = tmp_path / "wall of the gym.html", tmp_path / "site"
    assert main(["export", str(scan.root), "--format", "page", "-o", str(page)]) == 0
    assert main(["export", str(scan.root), "--format", "site", "-o", str(site)]) == 0
    with any_host(tmp_path) as host:
        urls = [
            page.as_uri(),
            f"{host}/wall%20of%20the%20gym.html",
            f"{host}/site/",
            (site / "index.html").as_uri(),
        ]
        run = subprocess.run(
            ["node", str(VIEWER / "tests" / "alone.mjs"), *urls],
            capture_output=True,
            text=True,
            cwd=VIEWER,
            check=True,
        )
    found = [json.loads(line) for line in run.stdout.splitlines()]
    assert [row["problem"] for row in found] == [""] * 4
    for row in found[:2]:  # the one file asks for nothing else
        others = [url for url in row["asked"] if not url.startswith(("data:", "blob:"))]
        assert others == [row["url"]]
