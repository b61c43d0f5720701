"""Tables that people open in a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence


def csv_table(columns: Sequence[str], rows: Iterable[Mapping[str, object]]) -> str:
    """Rows as CSV with a first line of names; a list is its words with spaces between them."""
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
    """No formula to a spreadsheet (OWASP, CSV Injection)."""
    return "'" + text if text[:1] in tuple("=+-@\t\r＝＋－＠") else text
