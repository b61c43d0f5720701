"""The pages of a feature can be deleted: their folder, routes, texts and the link to them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest

_GYM = Path(__file__).resolve().parents[2]
_WEB = _GYM / "web"


def _without(text: str, feature: str) -> str:
    """Return a source without the lines of a feature, and without its name in lists of types."""
    for inline in (f" & typeof {feature}", f' | "{feature}"'):
        text = text.replace(inline, "")
    kept = [line for line in text.splitlines(keepends=True) if feature not in line]
    return "".join(kept)


@pytest.mark.slow
@pytest.mark.parametrize("feature", ["insights", "webhooks"])
def test_the_pages_of_a_feature_can_be_deleted(
    feature: str, tmp_path: Path, lacks: Callable[[str], NoReturn]
) -> None:
    if not (_WEB / "node_modules").is_dir():
        lacks("what the app's checks need is missing (cd gym/web && npm ci)")
    # The app's pages use some of the viewer's modules, by their place in the checkout.
    web = tmp_path / "gym" / "web"
    shutil.copytree(_WEB, web, ignore=shutil.ignore_patterns("node_modules", "tests", "build"))
    (web / "node_modules").symlink_to(_WEB / "node_modules")
    (tmp_path / "gym" / "src").symlink_to(_GYM / "src")
    (tmp_path / "viewer").symlink_to(_GYM.parent / "viewer")
    shutil.rmtree(web / "src" / feature)
    for name in ("routes.ts", "i18n.svelte.ts", "gyms/GymSettings.svelte"):
        source = web / "src" / name
        source.write_text(_without(source.read_text(), feature))
    done = subprocess.run(
        ["node_modules/.bin/svelte-check", "--tsconfig", "./tsconfig.json"],
        cwd=web,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
