"""Results as a table, and on paper."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from typing import Final

from walltopo_gym.competitions.board_view import (
    MAX_SHOWN_PROBLEMS,
    BoardView,
    Line,
    ProblemHead,
    RoundHead,
    RoundLine,
)
from walltopo_gym.competitions.scoring.rules import LEAD_RULES
from walltopo_gym.competitions.scoring.score import format_time
from walltopo_gym.paper.sheet import Paper, Sheet
from walltopo_gym.spreadsheets import CsvDialect, csv_table

_COLUMNS: Final = ("category", "rank", "shared", "bib", "name", "team", "club", "out", "points")
_OF_A_ROUND: Final = ("rank", "points", "tops", "zones", "flashes", "tries_to_top", "tries_to_zone")
_OF_A_LEAD_ROUND: Final = ("rank", "result", "tops")


def results_csv(board: BoardView, dialect: CsvDialect) -> str:
    """Return a line per competitor, by category; a round's columns begin with its name."""
    heads = [
        f"{number}. {one.name}: {name}"
        for number, one in enumerate(board.rounds, 1)
        for name in _round_columns(one)
    ]
    rows = (
        (
            category.name,
            line.rank,
            "yes" if line.tied else "",
            line.bib,
            line.name,
            line.team,
            line.club,
            line.out,
            _parse_points(line.points),
            *_round_cells(board, line),
        )
        for category in board.categories
        for line in category.lines
    )
    columns = [*_COLUMNS, *heads]
    return csv_table(columns, (dict(zip(columns, row, strict=True)) for row in rows), dialect)


def results_pdf(
    board: BoardView, gym: str, when: str, words: dict[str, str], size: Paper = "a4"
) -> tuple[bytes, set[str]]:
    """Return the results as PDF, and the characters that its font lacks.

    Parameters
    ----------
    when : the day as text; words : headings ("rank", "bib", "name", "team", "points", "out",
        "frozen", "lacks") in the reader's language.
    """
    sheet = Sheet(board.name, when, foot=gym, size=size, lacks=words["lacks"])
    if board.frozen_at is not None:
        sheet.text(words["frozen"], quiet=True)
    for category in board.categories:
        sheet.heading(category.name)
        heads = [words["rank"], words["bib"], words["name"], words["team"]]
        shown = [one for one in board.rounds if one.state != "waiting"]
        has_sum = any(line.points for line in category.lines)
        rows = [
            [
                _format_rank(line) or (words["out"] if line.out is not None else "–"),
                str(line.bib),
                line.name,
                line.team or line.club,
                *_round_results(line, {one.id for one in shown}),
                *([line.points] if has_sum and len(shown) > 1 else []),
            ]
            for line in category.lines
        ]
        heads += [one.name for one in shown]
        heads += [words["points"]] if has_sum and len(shown) > 1 else []
        widths = [1.2, 1.2, 5, 3.5, *[2.8 for _ in heads[4:]]]
        sheet.table(heads, rows, widths=widths, right={0, 1}, bold={2})
    if board.teams:
        sheet.heading(words["team"])
        rows = [
            [str(team.rank), team.name, ", ".join(team.members), team.points]
            for team in board.teams
        ]
        sheet.table(
            [words["rank"], words["team"], words["name"], words["points"]],
            rows,
            widths=[1, 3, 7, 2],
            right={0, 3},
            bold={1},
        )
    return sheet.pdf(), sheet.missing


def _format_rank(line: Line) -> str:
    return "" if line.rank is None else str(line.rank)


def _parse_points(points: str) -> Decimal | None:
    return Decimal(points) if points else None


def _round_columns(one: RoundHead) -> list[str]:
    """Return the columns of a round; in a lead round two for each route: high point and time."""
    if one.rules not in LEAD_RULES:
        return list(_OF_A_ROUND)
    # With the number: two routes may have the same label.
    routes = [f"{n}: {route.label}" for n, route in enumerate(_shown_routes(one), 1)]
    return [*_OF_A_LEAD_ROUND, *(f"{name} {at}" for at in routes for name in ("high", "seconds"))]


def _shown_routes(one: RoundHead) -> list[ProblemHead]:
    return one.problems if len(one.problems) <= MAX_SHOWN_PROBLEMS else []


def _round_cells(board: BoardView, line: Line) -> Iterator[Decimal | int | str | None]:
    for head, one in zip(board.rounds, line.rounds, strict=True):
        is_lead = head.rules in LEAD_RULES
        values = {"points": _parse_points(one.points)}
        for name in _OF_A_LEAD_ROUND if is_lead else _OF_A_ROUND:
            yield values.get(name, getattr(one, name)) if one.started else None
        for route in _shown_routes(head) if is_lead else ():
            high = one.highs.get(route.id)
            yield None if high is None else high.high or None
            yield None if high is None else high.seconds


def _round_results(line: Line, rounds: set[object]) -> list[str]:
    return [_short_result(one) for one in line.rounds if one.round_id in rounds]


def _short_result(one: RoundLine) -> str:
    """Return points, the high points of a lead round, or tops and zones with their tries as judges
    write them: 3T4z 5 6."""
    if not one.started:
        return ""
    highs = list(one.highs.values())
    if any(high.rank for high in highs):
        return f"{one.result} ({', '.join(high.high or '–' for high in highs)})"
    if len(highs) == 1 and highs[0].seconds is not None:
        return f"{one.result} {format_time(highs[0].seconds)}"
    if one.result:
        return one.result
    if one.points:
        return one.points
    return f"{one.tops}T{one.zones}z {one.tries_to_top} {one.tries_to_zone}"
