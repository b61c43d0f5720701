"""Each figure of README and docs stands in the record of the command that printed it."""

from __future__ import annotations

from pathlib import Path

import pytest
from tools.pages.figures import CONSTANTS, complaints, written
from tools.pages.records import RESULTS, Record, filled, main

from walltopo.core import InputError


def made(root: Path, page: str) -> Path:
    """A page, and beside it the record of one command."""
    (root / "docs").mkdir(exist_ok=True)
    output = ("| way | ARI |", "|---|---|", "| by name | 0.553 |", "", "by paint: ARI 0.692")
    record = Record(command="walltopo x DATA", on="four photos", output=output)
    record.save(root / RESULTS / "some.json")
    path = root / "docs" / "page.md"
    path.write_text(page, encoding="utf-8")
    return path


def test_a_table_is_written_from_its_record_and_an_old_one_is_reported(tmp_path: Path) -> None:
    page = made(tmp_path, "<!-- figures: some -->\nold\n<!-- /figures -->\n")
    assert any("not as recorded" in line for line in complaints(page, tmp_path))
    text = written(page, tmp_path)
    assert "| by name | 0.553 |" in text
    assert "`walltopo x DATA`; four photos" in text
    page.write_text(text, encoding="utf-8")
    assert complaints(page, tmp_path) == []


@pytest.mark.parametrize(
    ("prose", "figure"),
    [
        ('ARI [0.692](results/some.json "by paint")', None),
        ('ARI [.69](results/some.json "by paint")', None),
        ('ARI [69.2 %](results/some.json "by paint")', None),
        ('ARI [0.693](results/some.json "by paint")', "no line"),
        ('ARI [0.692](results/some.json "by name")', "no line"),
        ("ARI [0.692](results/other.json)", "no record"),
        ("ARI 0.692", "from no record"),
        ("ARI .692.", "from no record"),
        ("3 of 40 holds", "from no record"),
        ("off by 0.5 mm", "from no record"),
        ("after 2.9 s.", "from no record"),
        ("off by 5 mm", "from no record"),
        ("after 20 min", "from no record"),
        ("12 % of the holds", "from no record"),
        ("3 times as long", "from no record"),
        ("a wall of 4 x 3 m", None),
        ("noise of 1.5 mm/m", None),
        ("`0.692` is a setting", None),
    ],
)
def test_figures_in_prose(tmp_path: Path, prose: str, figure: str | None) -> None:
    found = complaints(made(tmp_path, f"{prose}\n"), tmp_path)
    if figure is None:
        assert found == []
    else:
        assert [figure in line for line in found] == [True]


def test_a_constant_is_no_figure_while_the_page_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(CONSTANTS, "page.md", ("8 mm",))
    assert complaints(made(tmp_path, "8 mm by default\n"), tmp_path) == []
    found = complaints(made(tmp_path, "9 mm by default\n"), tmp_path)
    assert [line.split(": ")[1] for line in found] == [
        "9 mm comes from no record",
        "8 mm is no constant of this page any more",
    ]


def test_a_command_is_run_and_what_it_prints_is_kept(tmp_path: Path) -> None:
    record = Record(command="python -c 'import sys; print(sys.argv[1])' DATA/a", on="nothing")
    record.save(tmp_path / "one.json")
    assert main(["one", "--folder", str(tmp_path), "--with", "DATA=/here"]) == 0
    found = Record.load(tmp_path / "one.json")
    assert found.output == ("DATA/a",), "no folder of a machine"
    assert found.command == record.command
    assert found.measured is not None
    with pytest.raises(InputError, match="DATA"):
        filled(record.command, {})


def test_a_failed_command_leaves_the_record(tmp_path: Path) -> None:
    before = Record(command="python -c 'raise SystemExit(3)'", on="nothing", output=("old",))
    before.save(tmp_path / "one.json")
    assert main(["one", "--folder", str(tmp_path)]) == 3
    assert Record.load(tmp_path / "one.json").output == ("old",)
