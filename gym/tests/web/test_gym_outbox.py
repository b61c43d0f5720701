"""The app's outbox on its own: `gym/web/tests/outbox`, by node's test runner."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

WEB = Path(__file__).resolve().parents[2] / "web"
TESTS = sorted(map(str, (WEB / "tests" / "outbox").glob("*.test.mjs")))


def test_what_is_said_without_reception_arrives_once(lacks: Callable[[str], NoReturn]) -> None:
    if shutil.which("node") is None or not (WEB / "node_modules" / "fake-indexeddb").is_dir():
        lacks("node, or what the app's tests need, is missing (cd gym/web && npm ci)")
    done = subprocess.run(
        ["node", "--test", "--test-reporter=tap", *TESTS],
        cwd=WEB, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    assert "# fail 0" in done.stdout
    assert "# pass 0" not in done.stdout
