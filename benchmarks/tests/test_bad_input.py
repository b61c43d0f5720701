"""Twenty-odd kinds of bad input: a clear message, the right exit code, never a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.bad_input import CASES, Case
from benchmarks.bad_pictures import picture
from benchmarks.bad_platform import (
    PLATFORM_CASES,
    PLATFORM_HEAD,
    ROOT,
    PlatformCase,
    platform_rows,
)

from walltopo.cli import main
from walltopo.core.files import read_json


def _run(
    arguments: list[str], capsys: pytest.CaptureFixture[str], command: str = "scan"
) -> tuple[int, str]:
    try:
        code = main([command, *arguments])
    except SystemExit as error:  # wrong usage, reported by argparse
        code = int(str(error.code))
    captured = capsys.readouterr()
    return code, captured.out + captured.err


_SLOW = {"photos that show nothing in common", "a picture of 1.6 gigapixels"}


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.name, marks=[pytest.mark.slow] if case.name in _SLOW else [])
        for case in CASES
    ],
)
def test_bad_input(case: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, output = _run(case.make(tmp_path), capsys, case.command)
    flat = " ".join(output.split())
    assert case.says in flat
    assert code == case.code, output
    assert "Traceback" not in output
    assert "defect in walltopo" not in output


@pytest.mark.parametrize("case", PLATFORM_CASES, ids=lambda case: case.given)
def test_each_case_of_the_platform_has_its_test(case: PlatformCase) -> None:
    path, name = case.test
    content = (ROOT / "gym" / path).read_text("utf-8")
    assert f"def {name}(" in content or f'test("{name}"' in content


def test_the_page_has_what_the_platform_answers() -> None:
    page = (ROOT / "docs" / "bad-input.md").read_text("utf-8")
    assert page.endswith(PLATFORM_HEAD + "\n".join(platform_rows()) + "\n")


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

    monkeypatch.setattr("walltopo.reconstruct.ingest.selection.decode_files", full)
    capsys.readouterr()
    code, output = _run([str(folder), "-o", str(out), "--to", "ingest", "--force"], capsys)
    assert code == 5
    assert "no space left while writing" in output
    assert len(list((out / "photos").iterdir())) == 3  # the old photos are still there
    assert read_json(out / "scan.json")["stages"]["ingest"]["state"] == "failed"
