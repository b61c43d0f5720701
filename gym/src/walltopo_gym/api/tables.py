"""Tables as files: CSV as the spreadsheets of the reader's language expect it."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Header, Query
from starlette.responses import Response

from walltopo_gym.spreadsheets import CsvDialect, dialect_of

_LANGUAGE = r"^[A-Za-z]{2,3}(-[A-Za-z0-9]{1,8})*$"


def _csv_dialect(
    language: Annotated[
        str | None,
        Query(
            max_length=35,
            pattern=_LANGUAGE,
            description="of the spreadsheet, such as de-CH; default: the header Accept-Language",
        ),
    ] = None,
    accept_language: Annotated[str, Header(include_in_schema=False)] = "",
) -> CsvDialect:
    return dialect_of(language or accept_language)


CsvDialectOf = Annotated[CsvDialect, Depends(_csv_dialect)]


class CsvFile(Response):
    """A table to download, named `NAME.csv`."""

    media_type = "text/csv"

    @classmethod
    def of(cls, name: str, table: str) -> CsvFile:
        """Return the response with a table of `csv_table`."""
        headers = {
            "content-disposition": f'attachment; filename="{name}.csv"',
            "vary": "accept-language",
        }
        return cls(table, headers=headers)
