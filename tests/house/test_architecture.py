"""The page that leads through the house names rooms and files that are there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def test_every_file_that_the_page_names_is_there() -> None:
    named = set(re.findall(r"`([\w/]+\.py)`", PAGE)) - {"contract.py", "stage.py"}
    missing = {name for name in named if not (ROOT / "src" / "walltopo" / name).is_file()}
    assert len(named) > 40
    assert missing == set()


def test_every_room_is_on_the_page() -> None:
    rooms = {path.parent.name for path in (ROOT / "src" / "walltopo").glob("*/__init__.py")}
    table = set(re.findall(r"^\| `(\w+)` \|", PAGE, flags=re.M)) | {"cli", "pipeline"}
    assert rooms - table == set()


def test_every_benchmark_that_a_page_names_is_there() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *ROOT.glob("lab/*.md")]
    named = {
        name
        for page in pages
        for name in re.findall(r"walltopo_lab\.benchmarks\.(\w+)", page.read_text(encoding="utf-8"))
    }
    folder = ROOT / "lab" / "src" / "walltopo_lab" / "benchmarks"
    missing = {name for name in named if not (folder / f"{name}.py").is_file()} - {"NAME", "X"}
    assert len(named) > 10
    assert missing == set()
