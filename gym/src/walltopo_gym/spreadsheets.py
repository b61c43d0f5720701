"""CSV tables for spreadsheets, and tables that come from them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Final

from walltopo_gym.errors import RequestError
from walltopo_gym.texts import UNPRINTABLE, one_line, same_key

MAX_FAULTS: Final = 100  # a table with more is read no further
_MAX_TITLE: Final = 10  # lines that may stand above the heading
# The first bytes of .xlsx and .xls, as windows-1252 and windows-1250 have them.
_WORKBOOKS: Final = "PK\x03\x04", "\xd0\xcf\x11\xe0", "\u0110\u010e\x11\u0155"
_WEB_PAGE: Final = re.compile(r"<(!doctype|html|table|\?xml|meta|head|body)", re.IGNORECASE)
MAX_SHOWN: Final = 40  # characters of a cell in an error message
BOM: Final = "\ufeff"
# A text that `escape_formula` has marked is marked again, so that the mark can be taken off.
_FORMULA: Final = re.compile(r"'*[=+\-@\t\r＝＋－＠]")
_SPLITS: Final = re.compile(r"[,;\t\"\r\n]")
_LINE: Final = re.compile(rf"[^{UNPRINTABLE}]*")


@dataclass(frozen=True)
class CsvDialect:
    """The separator and the decimal sign that the spreadsheets of a country expect in CSV."""

    separator: str
    decimal: str


_ENGLISH: Final = CsvDialect(",", ".")
_DIALECTS: Final = {
    "en": _ENGLISH,
    "de": CsvDialect(";", ","),
    "de-ch": CsvDialect(";", "."),
    "de-li": CsvDialect(";", "."),
    "fr": CsvDialect(";", ","),
    "cs": CsvDialect(";", ","),
}


def dialect_of(languages: str) -> CsvDialect:
    """Return the dialect of the preferred known language; English if none is known.

    Parameters
    ----------
    languages : as in the header Accept-Language ("de-CH, fr;q=0.5"), or one language.
    """
    tags = [
        (tag.strip().lower(), _weight(rest))
        for tag, _, rest in (each.partition(";") for each in languages.split(","))
    ]
    for tag, weight in sorted(tags, key=lambda pair: -pair[1]):
        found = _DIALECTS.get(tag) or _DIALECTS.get(tag.partition("-")[0])
        if found is not None and weight > 0:
            return found
    return _ENGLISH


def _weight(text: str) -> float:
    found = re.fullmatch(r"\s*q=([01](?:\.[0-9]{0,3})?)\s*", text, re.IGNORECASE)
    return float(found[1]) if found else 1.0


def csv_table(
    columns: Sequence[str], rows: Iterable[Mapping[str, object]], dialect: CsvDialect
) -> str:
    """Return rows as CSV with a first line of names, for spreadsheets and for `read_table`.

    The byte order mark makes Excel read UTF-8. Lists become words separated by spaces.
    """
    lines = [
        [_quote_cell(name) for name in columns],
        *([_format_cell(row.get(name), dialect.decimal) for name in columns] for row in rows),
    ]
    return BOM + "".join(f"{dialect.separator.join(line)}\n" for line in lines)


def _format_cell(value: object, decimal: str) -> str:
    if value is None:
        return ""
    if isinstance(value, (float, Decimal)):
        return str(value).replace(".", decimal)
    if isinstance(value, (list, tuple)):
        value = " ".join(str(word) for word in value)
    return _quote_cell(escape_formula(value)) if isinstance(value, str) else str(value)


def _quote_cell(cell: str) -> str:
    """Return a cell with quotes if any reader might split it."""
    return '"' + cell.replace('"', '""') + '"' if _SPLITS.search(cell) else cell


def escape_formula(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula (OWASP, CSV Injection)."""
    return "'" + text if _FORMULA.match(text) else text


def unescape_formula(cell: str) -> str:
    """Return the text that `escape_formula` was given."""
    return cell[1:] if cell[:1] == "'" and _FORMULA.match(cell[1:]) else cell


@dataclass(frozen=True)
class Fault:
    """An error in a line (the head is line 1), with a hint."""

    line: int
    column: str
    error: RequestError


def read_table(
    text: str, columns: Sequence[str], needed: str, max_lines: int
) -> Iterator[tuple[int, dict[str, str]]]:
    """Return the lines of a table that are not empty: their number, and their cells by column.

    Parameters
    ----------
    text : lines with commas, semicolons or tabs between the columns. One of the first lines names
        them: above it may stand Excel's `sep=;` and a title. Columns without a name at the end are
        dropped if they are empty. Cells come back as `one_line` writes them.
    columns : the known ones; needed : the one that must be there.

    Raises
    ------
    RequestError : the text is not such a table, or has more than `max_lines` lines.
    """
    if "\ufffd" in text:
        raise RequestError("table-letters", "table-send-file")
    text = plain_lines(text)
    _check_text(text)
    # Excel's own line for the separator; its number counts, so that the others keep theirs.
    declared = re.match(r'"?sep=(.)"?\n', text)
    text = text[declared.end() :] if declared else text
    title = _title_lines(text, columns, needed)
    above = title + (1 if declared else 0)
    text = text.split("\n", title)[-1]
    head = text.partition("\n")[0]
    between = declared[1] if declared else _find_separator(head, columns)
    reader = csv.reader(io.StringIO(text), delimiter=between, strict=True)
    try:
        named = column_names(next(reader))
    except (StopIteration, csv.Error) as error:
        raise RequestError("table-none", "table-head") from error
    while named and not named[-1]:
        named.pop()
    _check_columns(named, columns, needed)
    try:
        number = 0
        for line in reader:
            if not any(cell.strip() for cell in line):
                continue
            number += 1
            if number > max_lines:
                raise RequestError("table-too-long", "table-in-parts", most=max_lines)
            at = reader.line_num + above
            if any(cell.strip() for cell in line[len(named) :]):
                raise RequestError("table-no-column", "table-head", number=at)
            cells = (one_line(unescape_formula(cell.strip())) for cell in line)
            yield at, dict(zip(named, cells, strict=False))
    except csv.Error as error:
        raise RequestError("table-line", number=reader.line_num + above) from error


def _check_text(text: str) -> None:
    """Refuse a file that is no text table: a workbook, a web page.

    Raises
    ------
    RequestError : says what it is, and how to save a table.
    """
    begin = text[:200].lstrip()
    if begin.startswith(_WORKBOOKS):
        raise RequestError("table-workbook", "table-save-csv")
    if _WEB_PAGE.match(begin):
        raise RequestError("table-web-page", "table-save-csv")


def _title_lines(text: str, columns: Sequence[str], needed: str) -> int:
    """Return how many lines stand above the first one that names the needed column; 0 without it.

    A title names no column, or it would be a heading with errors.
    """
    for number, line in enumerate(text.split("\n")[:_MAX_TITLE]):
        names = column_names(line.split(_find_separator(line, columns)))
        if needed in names:
            return number
        if any(name in columns for name in names):
            return 0
    return 0


def _find_separator(head: str, columns: Sequence[str]) -> str:
    """Return the separator that makes the most known columns of a first line."""

    def known(separator: str) -> tuple[int, int]:
        names = column_names(head.split(separator))
        return sum(name in columns for name in names), len(names)

    return max(",;\t", key=known)


def plain_lines(text: str) -> str:
    """Return a table's text without the byte order mark, its lines ended by line feeds."""
    return text.lstrip(BOM).replace("\r\n", "\n").replace("\r", "\n")


def column_names(cells: Sequence[str]) -> list[str]:
    """Return names of columns without spaces, quotes and capitals: "Set on" is "set_on"."""
    return [same_key(cell.strip().strip('"')).replace(" ", "_") for cell in cells]


def _check_columns(named: Sequence[str], columns: Sequence[str], needed: str) -> None:
    unknown = [name for name in named if name not in columns]
    if unknown:
        raise RequestError(
            "table-unknown", "table-known", name=unknown[0][:MAX_SHOWN], names=", ".join(columns)
        )
    if len(set(named)) < len(named):
        raise RequestError("table-twice")
    if needed not in named:
        raise RequestError("table-no-name", "table-head")


def check_cell(cell: str, most: int) -> RequestError | None:
    """Return why a cell's text is not accepted: it is too long or not printable; None if it is."""
    if len(cell) <= most and _LINE.fullmatch(cell):
        return None
    return RequestError("cell-too-long", "cell-shorten", most=most)
