"""CSV tables for spreadsheets, and tables that come from them."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from walltopo_gym.errors import RequestError

MAX_FAULTS: Final = 100  # a table with more is read no further
MAX_SHOWN: Final = 40  # characters of a cell in an error message
_LINE: Final = re.compile(r"[^\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]*")


def csv_table(columns: Sequence[str], rows: Iterable[Mapping[str, object]]) -> str:
    """Return rows as CSV with a first line of names; lists become words separated by spaces."""
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _cell(value) for name, value in row.items()})
    return out.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, (list, tuple)):
        value = " ".join(str(word) for word in value)
    return harmless(value) if isinstance(value, str) else value


def harmless(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula (OWASP, CSV Injection)."""
    return "'" + text if text[:1] in tuple("=+-@\t\r＝＋－＠") else text


@dataclass(frozen=True)
class Fault:
    """An error in a line (the head is line 1), with a hint."""

    line: int
    column: str
    problem: RequestError


def read_table(
    text: str, columns: Sequence[str], needed: str, max_lines: int
) -> Iterator[tuple[int, dict[str, str]]]:
    """Return the lines of a table that are not empty: their number, and their cells by column.

    Parameters
    ----------
    text : lines with commas, semicolons or tabs between the columns; the first names them, or the
        second after Excel's `sep=;`. Columns without a name at the end are dropped if they are
        empty. Cells come back in Unicode's form NFC.
    columns : the known ones; needed : the one that must be there.

    Raises
    ------
    RequestError : the text is not such a table, or has more than `max_lines` lines.
    """
    if "\ufffd" in text:
        raise RequestError("table-letters", "table-send-file")
    text = unicodedata.normalize("NFC", text.lstrip("\ufeff"))
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    # Excel's own line for the separator; its number counts, so that the others keep theirs.
    declared = re.match(r'"?sep=(.)"?\n', text)
    above = 1 if declared else 0
    text = text[declared.end() :] if declared else text
    head = text.partition("\n")[0]
    between = declared[1] if declared else max(",;\t", key=head.count)
    reader = csv.reader(io.StringIO(text), delimiter=between, strict=True)
    try:
        named = [cell.strip().lower().replace(" ", "_") for cell in next(reader)]
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
            yield at, {name: cell.strip() for name, cell in zip(named, line, strict=False)}
    except csv.Error as error:
        raise RequestError("table-line", number=reader.line_num + above) from error


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
