"""The page of the publication has every algorithm, equation and table, and names real files."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "publication.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    return PAGE.split(f"## {title}\n")[1].split("\n## ")[0]


def test_every_algorithm_has_a_row() -> None:
    assert re.findall(r"^\| (\d) ", section("Algorithms"), flags=re.M) == list("123456789")


def test_every_numbered_equation_has_a_row() -> None:
    covered: list[int] = []
    for row in re.findall(r"^\| (2\.\d[^|]*)\|", section("Equations"), flags=re.M):
        numbers = [int(n) for n in re.findall(r"\b2\.(\d+)", row)]
        covered += range(numbers[0], numbers[-1] + 1)
    assert covered == list(range(1, 32))
    assert "3.3.3" in section("Equations")


def test_every_table_has_a_row() -> None:
    rows = re.findall(r"^\| (\d\.\d)", section("Tables"), flags=re.M)
    assert sorted(set(rows)) == ["1.1", "4.1", "4.2", "4.3", "4.4", "4.5"]


def test_every_file_that_the_page_names_is_there() -> None:
    named = re.findall(r"`(lab:)?([\w/]+\.py)`", PAGE)
    folders = {"": "src/walltopo", "lab:": "lab/src/walltopo_lab"}
    missing = [name for lab, name in named if not (ROOT / folders[lab] / name).is_file()]
    assert len(named) > 30
    assert missing == []
