"""CSV tables: written for the spreadsheets of a language, and read again."""

from __future__ import annotations

from decimal import Decimal

import pytest

from walltopo_gym.spreadsheets import csv_table, dialect_of, read_table
from walltopo_gym.texts import one_line

COLUMNS = ("name", "points", "share", "note")
ROWS: list[dict[str, object]] = [
    {"name": "Jana Nováková", "points": Decimal("24.9"), "share": 0.5, "note": "a, b; c\td"},
    {"name": 'Ivo "Böhm"', "points": -3, "share": None, "note": "=1+2"},
    {"name": "-Ö", "points": 0, "share": 1.0, "note": "'=1+2"},
    {"name": "''@", "points": 7, "share": 12.25, "note": "two\nlines"},
]


@pytest.mark.parametrize("language", ["en", "de", "de-CH", "fr", "cs"])
def test_the_reader_reads_what_the_writer_writes(language: str) -> None:
    dialect = dialect_of(language)
    found = list(read_table(csv_table(COLUMNS, ROWS, dialect), COLUMNS, "name", 100))
    assert [cells["name"] for _, cells in found] == [row["name"] for row in ROWS]
    assert [cells["note"] for _, cells in found] == [one_line(str(row["note"])) for row in ROWS]
    points = [cells["points"].replace(dialect.decimal, ".") for _, cells in found]
    assert points == ["24.9", "-3", "0", "7"]


@pytest.mark.parametrize("language", ["en", "de"])
def test_a_table_of_one_column_stays_one(language: str) -> None:
    table = csv_table(["name"], [{"name": "Novák, Jan"}, {"name": "a;b"}], dialect_of(language))
    found = [cells["name"] for _, cells in read_table(table, ["name"], "name", 100)]
    assert found == ["Novák, Jan", "a;b"]


@pytest.mark.parametrize(
    ("language", "line"),
    [
        ("en", "Jana,24.9,0.5,-3"),
        ("de", "Jana;24,9;0,5;-3"),
        ("fr", "Jana;24,9;0,5;-3"),
        ("de-CH", "Jana;24.9;0.5;-3"),
    ],
)
def test_numbers_stay_numbers_in_the_spreadsheets_of_a_language(language: str, line: str) -> None:
    row = {"name": "Jana", "points": Decimal("24.9"), "share": 0.5, "note": -3}
    assert csv_table(COLUMNS, [row], dialect_of(language)).splitlines()[1] == line


@pytest.mark.parametrize(
    ("languages", "separator", "decimal"),
    [
        ("", ",", "."),
        ("*", ",", "."),
        ("en-GB,en;q=0.9,de;q=0.8", ",", "."),
        ("de-AT,de;q=0.9,en;q=0.8", ";", ","),
        ("es,fr;q=0.5,en;q=0.1", ";", ","),
        ("en;q=0.3, cs;q=0.7", ";", ","),
        ("de;q=0, en", ",", "."),
        ("DE-ch", ";", "."),
        ("ja;q=x;;,", ",", "."),
    ],
)
def test_the_preferred_known_language_decides(languages: str, separator: str, decimal: str) -> None:
    dialect = dialect_of(languages)
    assert (dialect.separator, dialect.decimal) == (separator, decimal)


def test_excel_sees_that_a_table_is_utf8() -> None:
    assert csv_table(["name"], [], dialect_of("en")).encode() == b"\xef\xbb\xbfname\n"
