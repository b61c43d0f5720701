"""The board of a competition: lines by category, recomputed only where results changed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from datetime import datetime
from fractions import Fraction
from uuid import UUID

from walltopo_gym.competitions.board_view import (
    MAX_SHOWN_PROBLEMS,
    BoardView,
    CategoryLines,
    HighPoint,
    Line,
    ProblemHead,
    RoundHead,
    RoundLine,
    Team,
)
from walltopo_gym.competitions.ranking import (
    Rank,
    Standing,
    Step,
    compared_criteria,
    ranks_by_key,
    standing_in,
    standing_in_all,
    standing_in_league,
)
from walltopo_gym.competitions.results import Results
from walltopo_gym.competitions.scoring.score import NOTHING, Mark, Score, best_of, format_points
from walltopo_gym.competitions.sheet import Competitor, Format, RoundSheet, Sheet
from walltopo_gym.errors import NotFoundError


class Leaderboard:
    """Ranks of a competition over its results."""

    def __init__(self, sheet: Sheet) -> None:
        self.results = Results(sheet)
        self.seq = 0
        self.at: datetime | None = None
        self._lines: dict[UUID, list[Line]] = {}

    @property
    def sheet(self) -> Sheet:
        """Return the competition's sheet."""
        return self.results.sheet

    def lines(self) -> dict[UUID, list[Line]]:
        """Return the lines by category, in order; competitors without a rank come last."""
        for category in self.results.touched:
            self._lines[category] = self._ranked_lines(category)
        self.results.touched.clear()
        return {category: self._lines[category] for category, _ in self.sheet.categories}

    def view(self, category: UUID | None = None) -> BoardView:
        """Return the whole board, or one category."""
        sheet, lines = self.sheet, self.lines()
        return BoardView(
            competition_id=sheet.id,
            name=sheet.name,
            state=sheet.state,
            format=sheet.format,
            frozen_at=sheet.frozen_at,
            seq=self.seq,
            revision=sheet.revision,
            at=self.at,
            rounds=[_round_head(one) for one in sheet.rounds],
            categories=[
                CategoryLines(known, name, lines[known])
                for known, name in sheet.categories
                if category in (None, known)
            ],
            teams=self.teams(),
        )

    def teams(self) -> list[Team]:
        """Return the teams of a league: the best members of each, over all categories."""
        if self.sheet.format != Format.LEAGUE:
            return []
        members = defaultdict[str, list[tuple[Fraction, str]]](list)
        for who in self.sheet.entries:
            standing = self._standing(who)
            if who.team and standing is not None and standing.points is not None:
                members[who.team].append((standing.points, who.name))
        sums = {
            team: best_of((points for points, _ in all_of), self.sheet.team_size)
            for team, all_of in members.items()
        }
        ranks = ranks_by_key({team: (points,) for team, points in sums.items()})
        return [
            Team(
                ranks[team].rank,
                ranks[team].tied,
                team,
                format_points(sums[team]),
                sorted(name for _, name in members[team]),
            )
            for team in sorted(sums, key=lambda team: (ranks[team].rank, team))
        ]

    def ranks_in(self, one: RoundSheet, category: UUID) -> dict[UUID, Rank]:
        """Return the ranks in a round of those who climbed in it."""
        number = self.sheet.rounds.index(one) + 1
        standings = {
            who.id: self._standing_in(who, number)
            for who in self._of(category)
            if who.id not in self.results.outs and self.results.score(one, who) is not None
        }
        return ranks_by_key({who: standing.key for who, standing in standings.items()})

    def compare(self, first: UUID, second: UUID) -> list[Step]:
        """Return the comparison of two competitors of one category; empty where one has no rank.

        Raises
        ------
        NotFoundError : no such entries in one category.
        """
        one, other = (self.results.competitors.get(entry) for entry in (first, second))
        if one is None or other is None or one.category != other.category:
            raise NotFoundError("cup-no-such-two")
        standings = self._standing(one), self._standing(other)
        if standings[0] is None or standings[1] is None:
            return []
        return compared_criteria(standings[0], standings[1])

    def _ranked_lines(self, category: UUID) -> list[Line]:
        who = self._of(category)
        standings = {one.id: self._standing(one) for one in who}
        overall = ranks_by_key({of: s.key for of, s in standings.items() if s is not None})
        in_rounds = [(one, self.ranks_in(one, category)) for one in self.sheet.rounds]
        lines = [
            Line(
                entry_id=one.id,
                bib=one.bib,
                name=one.name,
                team=one.team,
                club=one.club,
                rank=overall[one.id].rank if one.id in overall else None,
                tied=one.id in overall and overall[one.id].tied,
                out=self.results.outs.get(one.id),
                points=self._points(standings[one.id]),
                rounds=[self._round_line(one, of, ranks) for of, ranks in in_rounds],
            )
            for one in who
        ]
        last = len(lines) + 1
        return sorted(lines, key=lambda line: (line.rank or last, line.bib))

    def _of(self, category: UUID) -> list[Competitor]:
        return [who for who in self.sheet.entries if who.category == category]

    def _points(self, standing: Standing | None) -> str:
        is_sum = self.sheet.format != Format.ROUNDS
        if not is_sum or standing is None or standing.points is None:
            return ""
        return format_points(standing.points)

    def _standing(self, who: Competitor) -> Standing | None:
        """Return a competitor's standing; None without results or after disqualification."""
        scores = self._scores(who)
        if not scores or who.id in self.results.outs:
            return None
        sheet = self.sheet
        if sheet.format == Format.LEAGUE:
            return standing_in_league(scores.values(), sheet.league_best, who.handicap)
        reached = max(n for n, one in enumerate(sheet.rounds, 1) if one.id in scores)
        if sheet.format == Format.ROUNDS:
            return standing_in_all(sheet.rounds, self._whole(scores, who.category), reached)
        return self._standing_in(who, reached)

    def _standing_in(self, who: Competitor, number: int) -> Standing:
        """Return a competitor's standing in a round, by its number from 1."""
        rounds = self.sheet.rounds
        if self.sheet.format == Format.LEAGUE:
            return standing_in(rounds[number - 1 : number], self._scores(who), 1)
        return standing_in(rounds, self._whole(self._scores(who), who.category), number)

    def _scores(self, who: Competitor) -> dict[UUID, Score]:
        found = {one.id: self.results.score(one, who) for one in self.sheet.rounds}
        return {one: score for one, score in found.items() if score is not None}

    def _whole(self, scores: Mapping[UUID, Score], category: UUID) -> dict[UUID, Score]:
        """Return the scores with empty ones for the rounds that a competitor was not in."""
        return {
            one.id: scores.get(one.id) or self.results.empty(one, category)
            for one in self.sheet.rounds
        }

    def _round_line(
        self, who: Competitor, one: RoundSheet, ranks: Mapping[UUID, Rank]
    ) -> RoundLine:
        score = self.results.score(one, who)
        found = score or self.results.empty(one, who.category)
        rank = ranks.get(who.id)
        is_short = len(one.problems) <= MAX_SHOWN_PROBLEMS
        marks = self.results.marks_in(one, who.id) if is_short else {}
        return RoundLine(
            round_id=one.id,
            rank=None if rank is None else rank.rank,
            started=score is not None,
            points="" if found.points is None or score is None else format_points(found.points),
            tops=found.tops,
            zones=found.zones,
            flashes=found.flashes,
            tries_to_top=found.tries_to_top,
            tries_to_zone=found.tries_to_zone,
            marks={problem: (mark.tries, mark.zone, mark.top) for problem, mark in marks.items()},
            result="" if score is None else found.result,
            highs=self._highs(who, one, marks)
            if one.scoring.is_lead and score and is_short
            else {},
        )

    def _highs(
        self, who: Competitor, one: RoundSheet, marks: Mapping[UUID, Mark]
    ) -> dict[UUID, HighPoint]:
        """Return the high points of a lead round; with ranks also of routes not tried."""
        if not one.scoring.is_lead:
            return {}
        ranks = self.results.route_ranks(one, who)
        if len(ranks) < 2:
            return {route: HighPoint(mark.high, mark.seconds, "") for route, mark in marks.items()}
        found = [(route, rank, marks.get(route, NOTHING)) for route, rank in ranks.items()]
        return {
            route: HighPoint(mark.high, mark.seconds, format_points(rank))
            for route, rank, mark in found
        }


def _round_head(one: RoundSheet) -> RoundHead:
    return RoundHead(
        one.id,
        one.name,
        one.kind,
        one.state,
        one.scoring.rules,
        [ProblemHead(task.id, task.label, task.colour) for task in one.problems],
    )
