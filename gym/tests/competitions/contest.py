"""A competition in a gym of the tests, and people who climb and judge in it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any
from uuid import UUID, uuid4

import httpx
from gym.tests.worlds import Somebody, World, hold

from walltopo_gym.clock import now

_TAPS = itertools.count(1)
PROBLEMS = ("Moon", "Plum", "Left", "Cold")


def hang_routes(world: World) -> list[str]:
    """Routes on the world's wall; their ids in order."""
    holds = [hold(n, 0.3 * n, 1.0) for n in range(1, 2 * len(PROBLEMS) + 1)]
    routes = {n: [2 * n - 1, 2 * n] for n in range(1, len(PROBLEMS) + 1)}
    scan = world.reviewed(routes, holds)
    entries = [{"number": n, "name": name} for n, name in enumerate(PROBLEMS, 1)]
    answer = world.publish(scan, *entries)
    assert answer.is_success, answer.text
    return [route["id"] for route in sorted(world.published()["routes"], key=lambda r: r["number"])]


@dataclass
class Contest:
    """A competition through its API.

    Parameters
    ----------
    routes : that its first round has for problems; words : of its making, where not the usual.
    """

    world: World
    words: dict[str, Any] = field(default_factory=dict)
    routes: list[str] = field(default_factory=list)
    sheet: dict[str, Any] = field(default_factory=dict)

    def make(self) -> Contest:
        """Make it."""
        given = {
            "name": "Spring Cup",
            "format": "festival",
            "categories": [{"name": "Open"}],
            "rounds": [
                {
                    "name": "Session",
                    "scoring": {"rules": "points"},
                    "route_ids": self.routes,
                    "problems": [] if self.routes else [{"name": n} for n in PROBLEMS],
                }
            ],
        }
        answer = self.ask("POST", "", given | self.words)
        assert answer.status_code == 201, answer.text
        self.sheet = answer.json()
        return self

    @property
    def path(self) -> str:
        return f"{self.world.path}/competitions/{self.sheet['id']}"

    def ask(
        self, method: str, path: str, json: object = None, who: str = "setter", **more: Any
    ) -> httpx.Response:
        """A request below it, by one of the world's people."""
        base = self.path if self.sheet else f"{self.world.path}/competitions"
        return self.world.server.ask(method, base + path, self.person(who), json, **more)

    def person(self, who: str) -> Somebody:
        return self.world.people[who]

    def move(self, state: str) -> None:
        """Bring it into a state."""
        answer = self.ask("PUT", "/state", {"state": state})
        assert answer.is_success, answer.text
        self.sheet = answer.json()

    def move_round(self, number: int, state: str) -> httpx.Response:
        """Begin or end a round, by its number from 0."""
        one = self.sheet["rounds"][number]["id"]
        return self.ask("PUT", f"/rounds/{one}/state", {"state": state})

    def entry(self, name: str, category: int = 0, **words: Any) -> str:
        """A new competitor's id."""
        body = {"name": name, "category_id": self.sheet["categories"][category]["id"]} | words
        answer = self.ask("POST", "/entries", body)
        assert answer.status_code == 201, answer.text
        made: str = answer.json()["id"]
        return made

    def problem(self, number: int, one: int = 0) -> str:
        """A problem's id, by its number in a round, both from 0."""
        found: str = self.sheet["rounds"][one]["problems"][number]["id"]
        return found

    def say(
        self,
        entry: str,
        kind: str,
        which: int | None = None,
        n: int | None = None,
        who: str = "judge",
        event: UUID | None = None,
        one: int = 0,
        **words: Any,
    ) -> httpx.Response:
        """A score event about a problem by its number."""
        problem = None if which is None else self.problem(which, one)
        body = score(entry, kind, problem, n, **({"device": who} | words))
        return self.ask("PUT", f"/events/{event or uuid4()}", body, who)

    def board(self, who: str = "nobody", at: datetime | None = None) -> dict[str, Any]:
        """The board, as somebody sees it."""
        query = "" if at is None else f"?at={at.isoformat().replace('+', '%2B')}"
        answer = self.ask("GET", f"/board{query}", who=who)
        assert answer.status_code == 200, answer.text
        content: dict[str, Any] = answer.json()
        return content

    def ranks(
        self, who: str = "nobody", at: datetime | None = None
    ) -> list[tuple[int | None, str]]:
        """Rank and name of the first category, in order."""
        lines = self.board(who, at)["categories"][0]["lines"]
        return [(line["rank"], line["name"]) for line in lines]


def score(
    entry: str, kind: str, problem: str | None, n: int | None, **words: object
) -> dict[str, object]:
    """The body of a score event that is made and sent now, unless the words say else."""
    moment = now().isoformat()
    return {
        "entry_id": entry,
        "kind": kind,
        "n": n,
        "number": next(_TAPS),
        "problem_id": problem,
        "made_at": moment,
        "sent_at": moment,
    } | words
