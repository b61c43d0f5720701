"""Each promise of docs/security.md names tests that are there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")


def test_every_promise_names_a_test() -> None:
    rows = re.findall(
        r"^\| (?!\*\*|\||-)(.+?) \| (.*?) \|$", PAGE.split("## Promises")[1], flags=re.M
    )
    assert len(rows) >= 15
    assert [promise for promise, shown in rows if not re.search(r"`test_|\"", shown)] == []


def test_every_test_that_the_page_names_is_there() -> None:
    files = [*(ROOT / "tests").rglob("test_*.py"), *(ROOT / "viewer" / "tests").glob("*.mjs")]
    written = "\n".join(path.read_text(encoding="utf-8") for path in files)
    functions = set(re.findall(r"`(test_\w+)`", PAGE))
    checks = set(re.findall(r'"([^"]+)" in Chromium', PAGE))
    assert len(functions) >= 20
    assert len(checks) >= 3
    assert [name for name in functions if f"def {name}(" not in written] == []
    assert [name for name in checks if f'async "{name}"' not in written] == []
