"""Twenty-odd kinds of bad input: a clear message, the right exit code, never a traceback."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from bad_input_cases import CASES, Case, picture  # type: ignore[import-not-found]

from walltopo.cli import main
from walltopo.core.files import read_json

TABLE = Path(__file__).parents[2] / "docs" / "bad-input.md"
HEAD = """\
# What happens with bad input

Written by `make docs` from `tests/scan/bad_input_cases.py`; the tests run every row. Exit codes:
0 done, 2 usage or settings, 3 the input, 4 no result from usable input, 5 the machine.

| given | exit | told |
|---|---|---|
"""


def _run(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    code = main(["scan", *arguments])
    captured = capsys.readouterr()
    return code, captured.out + captured.err


def _told(output: str, root: Path) -> str:
    """The lines that matter, without this machine's folders."""
    text = output.replace(str(root), "").replace("/in/", "in/")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    lines = [re.sub(r"\s+[\d.]+ s$", "", line) for line in lines if not line.startswith("✗")]
    return " / ".join(lines[:3]).replace("|", "\\|")


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_bad_input(case: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, output = _run(case.make(tmp_path), capsys)
    flat = " ".join(output.split())
    assert case.says in flat
    assert code == case.code, output
    assert "Traceback" not in output
    assert "defect in walltopo" not in output


def test_no_space_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    for k in range(3):
        picture(k).save(folder / f"p{k}.jpg")
    out = tmp_path / "scan"
    assert main(["scan", str(folder), "-o", str(out), "--to", "ingest"]) == 0

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("walltopo.photos.stage._store", full)
    capsys.readouterr()
    code, output = _run([str(folder), "-o", str(out), "--to", "ingest", "--force"], capsys)
    assert code == 5
    assert "no space left while writing" in output
    assert len(list((out / "photos").iterdir())) == 3  # the old photos are still there
    assert read_json(out / "scan.json")["stages"]["ingest"]["state"] == "failed"


@pytest.mark.skipif(not os.environ.get("WALLTOPO_WRITE_DOCS"), reason="only `make docs` writes it")
def test_write_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = []
    for number, case in enumerate(CASES):
        root = tmp_path / str(number)
        root.mkdir()
        code, output = _run(case.make(root), capsys)
        rows.append(f"| {case.name} | {code} | {_told(output, root)} |")
    TABLE.write_text(HEAD + "\n".join(rows) + "\n", encoding="utf-8")
