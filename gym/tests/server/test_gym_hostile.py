"""Whatever comes in by the document's own shape, or against it: an answer in words, never a 5xx."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import pytest
import schemathesis
from gym.tests.worlds import Server, World, hold, make_world
from hypothesis import HealthCheck, Phase, given, seed, settings
from schemathesis import GenerationMode

from walltopo_gym.accounts.actor import Scope

_EACH = 5
# The same requests in each run: what is found here is found again.
_CALM = settings(
    max_examples=_EACH,
    database=None,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


@dataclass
class Asker:
    """Sends what Schemathesis thinks of, into a gym of its own for each endpoint."""

    server: Server
    defects: list[str] = field(default_factory=list)
    statuses: Counter[int] = field(default_factory=Counter)

    def ask_all(self, operation: Any) -> None:
        world = make_world(self.server, visibility="public")
        program = self.server.token(world.owner, *Scope)
        askers = [world.owner.headers, program.headers, {}]
        turn = itertools.count()
        good, bad = (operation.as_strategy(generation_mode=mode) for mode in GenerationMode)

        @seed(0)
        @_CALM
        @given(good | bad)
        def ask(case: Any) -> None:
            number = next(turn)
            if number % 4:  # at what is there, so that the endpoint itself is reached
                case.path_parameters |= {
                    name: value for name, value in _known(world) if name in case.path_parameters
                }
            case.headers.update(askers[number % len(askers)])
            answer = case.call(app=self.server.app, base_url="https://testserver")
            self.statuses[answer.status_code] += 1
            if answer.status_code >= 500:
                defect = f"{case.method} {case.formatted_path} {case.body!r}: {answer.text}"
                self.defects.append(defect)

        ask()


def _known(world: World) -> list[tuple[str, str]]:
    found = {"gym": world.gym.slug, "wall": world.wall.id, "person": world.people["member"].id}
    return [(name, str(value)) for name, value in found.items()]


@pytest.mark.slow
def test_no_request_finds_a_defect(server: Server) -> None:
    """Good values and bad ones at every endpoint, by an owner, a program, and nobody."""
    asker = Asker(server)
    schema: Any = schemathesis.openapi.from_dict(server.app.openapi())
    for found in schema.get_all_operations():
        asker.ask_all(found.ok())
    assert asker.defects == []
    # They came through to the endpoints: some did what was asked, some judged its body.
    assert asker.statuses[200] >= 10
    assert asker.statuses[201] >= 3
    assert asker.statuses[422] >= 20


def test_no_answer_names_a_folder_of_the_server(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])  # a scan that lacks most of its files
    edits = {"edits": {"version": 2, "edits": []}}
    path = f"{world.path}/scans/{scan}/editor/log/try"
    answer = world.server.ask("POST", path, world.people["setter"], edits)
    assert answer.status_code == 422, answer.text
    assert str(world.server.settings.data) not in answer.text
    assert str(scan) not in answer.text


def test_an_endless_version_of_edits_is_refused(world: World) -> None:
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    path = f"{world.path}/scans/{scan}/editor/log"
    for version in ("9" * 5000, "9" * 30, "١"):
        body = {"edits": {"version": 2, "edits": []}, "version": version}
        answer = world.server.ask("POST", path, world.people["setter"], body)
        assert answer.status_code == 422, answer.text
        assert answer.json()["code"] == "edits-version"
