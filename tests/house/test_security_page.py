"""Each promise of the security pages names tests that are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# Page, where its tests are, and how many promises there are at least.
PAGES = {"security.md": (("tests", "viewer/tests"), 15), "gym-security.md": (("gym/tests",), 25)}


def read(page: str) -> str:
    return (ROOT / "docs" / page).read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES)
def test_every_promise_names_a_test(page: str) -> None:
    promises = read(page).split("## Promises")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (?!\*\*|\||-)(.+?) \| (.*?) \|$", promises, flags=re.M)
    assert len(rows) >= PAGES[page][1]
    assert [promise for promise, shown in rows if not re.search(r"`test_|\"", shown)] == []


@pytest.mark.parametrize("page", PAGES)
def test_every_test_that_a_page_names_is_there(page: str) -> None:
    folders, least = PAGES[page]
    files = [path for folder in folders for path in (ROOT / folder).rglob("*")
             if path.suffix == ".mjs" or path.match("test_*.py")]  # fmt: skip
    written = "\n".join(path.read_text(encoding="utf-8") for path in files)
    functions = set(re.findall(r"`(test_\w+)`", read(page)))
    checks = set(re.findall(r'"([^"]+)" in Chromium', read(page)))
    assert len(functions) >= least
    assert [name for name in functions if f"def {name}(" not in written] == []
    assert [name for name in checks if f'async "{name}"' not in written] == []
