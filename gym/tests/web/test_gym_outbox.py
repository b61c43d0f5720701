"""Parts of the app on their own: `gym/web/tests/{capture,competitions,outbox,shell}`, by Vitest."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

WEB = Path(__file__).resolve().parents[2] / "web"


def test_offline_entries_arrive_once(lacks: Callable[[str], NoReturn]) -> None:
    if shutil.which("node") is None or not (WEB / "node_modules" / "fake-indexeddb").is_dir():
        lacks("node, or what the app's tests need, is missing (cd gym/web && npm ci)")
    done = subprocess.run(
        ["node_modules/.bin/vitest", "run"],
        cwd=WEB,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
