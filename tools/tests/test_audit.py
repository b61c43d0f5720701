"""The audit passes only if it could check every package."""

from __future__ import annotations

import json

from tools.audit import code_of, of_npm, of_python, report

WELL = {"name": "numpy", "version": "2.4.0", "vulns": []}
WEAK = {
    "name": "pillow",
    "version": "9.0.0",
    "vulns": [{"id": "PYSEC-1", "fix_versions": ["9.0.1"], "aliases": []}],
}
OWN = {"name": "walltopo-gym", "skip_reason": "distribution marked as editable"}
NOT_FOUND = {"name": "rich", "skip_reason": "rich (15.0.0) is not on PyPI"}


def output(*rows: object) -> str:
    return json.dumps({"dependencies": rows, "fixes": []})


def npm(**weak: dict[str, str]) -> str:
    return json.dumps({"vulnerabilities": weak, "metadata": {"dependencies": {"prod": 7}}})


def test_all_was_checked_and_nothing_is_known() -> None:
    requests = [of_python(output(WELL, OWN), ""), of_npm("viewer", npm(), "")]
    assert code_of(requests) == 0
    assert "NOT ASKED" not in report(requests)
    assert [one.packages for one in requests] == [1, 7]


def test_a_known_weakness_is_named_with_what_mends_it() -> None:
    row = {"range": "<1.2", "severity": "high"}
    requests = [of_python(output(WELL, WEAK, NOT_FOUND), ""), of_npm("viewer", npm(three=row), "")]
    assert code_of(requests) == 1
    assert "pillow 9.0.0: PYSEC-1 (mended in 9.0.1)" in report(requests)
    assert "three <1.2: high" in report(requests)


def test_what_was_not_checked_is_reported_and_is_no_pass() -> None:
    silent = [
        of_python(output(WELL, NOT_FOUND), ""),
        of_python("", "Traceback\nConnectionError: PyPI does not answer\n"),
        of_npm("viewer", json.dumps({"message": "405 Method Not Allowed", "statusCode": 405}), ""),
        of_npm("viewer", "", "npm is not installed"),
    ]
    for one, why in zip(silent, ("rich (15.0.0)", "does not answer", "405", "npm is"), strict=True):
        assert code_of([one]) == 2
        assert why in report([one])
        assert "NOT ASKED" in report([one])
