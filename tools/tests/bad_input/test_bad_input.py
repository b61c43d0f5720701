"""Every kind of bad input: a clear message, the right exit code, never a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from tools.tests.bad_input.cases import CASES, Case
from tools.tests.bad_input.files import picture
from tools.tests.bad_input.page import platform_part
from tools.tests.bad_input.platform_cases import GYM, PLATFORM_CASES, PlatformCase

from walltopo.cli import main
from walltopo.core.files import read_json


def _run(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    try:
        code = main(arguments)
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
    code, output = _run(case.make(tmp_path), capsys)
    flat = " ".join(output.split())
    assert case.says in flat
    assert code == case.code, output
    assert "Traceback" not in output
    assert "defect in walltopo" not in output


@pytest.mark.parametrize("case", PLATFORM_CASES, ids=lambda case: case.given)
def test_each_case_of_the_platform_has_its_test(case: PlatformCase) -> None:
    content = (GYM / case.file).read_text("utf-8")
    assert f"def {case.test}(" in content or f'test("{case.test}"' in content


def test_the_page_has_what_the_platform_answers() -> None:
    page = (GYM.parent / "docs" / "bad-input.md").read_text("utf-8")
    assert page.endswith(platform_part())


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
    code, output = _run(["scan", str(folder), "-o", str(out), "--to", "ingest", "--force"], capsys)
    assert code == 5
    assert "no space left while writing" in output
    assert len(list((out / "photos").iterdir())) == 3  # the old photos are still there
    assert read_json(out / "scan.json")["stages"]["ingest"]["state"] == "failed"
