"""Routes in words: each spoken number agrees with the wall."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from fluent.syntax import FluentParser
from fluent.syntax import ast as syntax

import walltopo_climb.description
from walltopo.cli import main
from walltopo.core import InputError
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.moves import ClimberRow
from walltopo.scans.routes import Route, Routes
from walltopo_climb.description.sentences import (
    DETAILS,
    LANGUAGES,
    UNITS,
    Detail,
    Language,
    Sentence,
    Unit,
    Wording,
    sentences_of,
)
from walltopo_climb.description.steps import Step, StepKind, route_steps
from walltopo_climb.movement.body import Body
from walltopo_climb.movement.rows import climber_rows

TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "edge", "rail", "unknown")


def flat_wall(seed: int) -> tuple[list[Hold], Route, dict[int, tuple[float, float]]]:
    """Return the holds of a plane wall, a route, and each hold's place right and up the wall."""
    rng = np.random.default_rng(seed)
    lean, heading = math.radians(rng.uniform(-15, 40)), rng.uniform(0, 2 * np.pi)
    places = [(0.35 * (k % 2) + rng.uniform(-0.2, 0.2), 0.5 + 0.3 * k) for k in range(9)]
    turn = np.array(
        [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
    )
    holds = []
    for k, (right, up) in enumerate(places):
        # Before it is turned, the wall faces -y and overhangs towards it.
        place = np.array([right, -up * math.sin(lean), up * math.cos(lean)])
        normal = np.array([0.0, -math.cos(lean), -math.sin(lean)])
        place[:2], normal[:2] = turn @ place[:2], turn @ normal[:2]
        holds.append(
            Hold(
                id=k + 1,
                kind="hold",
                type=str(rng.choice(TYPES)),
                position=(float(place[0]), float(place[1]), float(place[2])),
                normal=(float(normal[0]), float(normal[1]), float(normal[2])),
                size=float(rng.uniform(0.03, 0.3)),
                steepness_deg=math.degrees(lean),
            )
        )
    route = Route(1, name="Test", holds=tuple(range(1, 10)), start=(3, 4), top=(9,))
    return holds, route, {hold.id: place for hold, place in zip(holds, places, strict=True)}


def steps_of(route: Route, holds: list[Hold], height: float) -> tuple[Step, ...]:
    row = climber_rows(route, holds, 1.0, {"you": Body(height)})[0]
    return route_steps(route, row, holds, 1.0)


@pytest.mark.parametrize("seed", range(24))
def test_directions_and_distances_are_those_of_the_wall(seed: int) -> None:
    holds, route, places = flat_wall(seed)
    steps = steps_of(route, holds, 1.75)
    at: dict[str, int] = {}
    moves = 0
    for step in steps:
        if step.kind in ("hand", "jump", "foot"):
            moves += 1
            right, up = np.subtract(places[step.hold], places[at[step.origin]])
            assert step.distance == pytest.approx(math.hypot(right, up), abs=1e-6)
            hour = math.degrees(math.atan2(right, up)) / 30 % 12
            away = abs(hour - step.clock) % 12
            assert min(away, 12 - away) <= 0.5 + 1e-6 or step.distance < 0.03
            assert step.height == pytest.approx(holds[step.hold - 1].position[2])
        if step.kind == "start_other":
            both = np.subtract(places[step.hold], places[at["left_hand"]])
            assert step.apart == pytest.approx(math.hypot(*both))
        if step.kind == "start_with_both":
            at |= {"left_hand": step.hold, "right_hand": step.hold}
        elif step.limb:
            at[step.limb] = step.hold
    assert moves
    last = steps[-1]
    assert last.kind in ("top", "out_of_reach")
    assert last.kind != "top" or last.hold == 9


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("language", LANGUAGES)
def test_each_number_of_a_sentence_is_that_of_its_step(language: Language, unit: Unit) -> None:
    for seed in range(8):
        holds, route, _ = flat_wall(seed)
        words = Wording(language, "full", unit)
        for sentence in sentences_of(steps_of(route, holds, 1.75), words):
            check_numbers(sentence, language, unit)


def check_numbers(sentence: Sentence, language: Language, unit: Unit) -> None:
    """Compare the digits of a sentence with its step, in the order of the sentence."""
    step = sentence.step
    spoken = [float(one.replace(",", ".")) for one in re.findall(r"\d+(?:[.,]\d+)?", sentence.text)]
    step_of = 10 if unit == "hands" else 5
    factor = 10 if unit == "hands" else 1
    for value in (step.distance, step.apart):
        if value:
            nearest = max(round(value * 100 / step_of), 1) * step_of / factor
            assert nearest in spoken, sentence.text
            spoken.remove(nearest)
    if step.clock and language != "cs":  # Czech says the hours in words
        assert step.clock in spoken, sentence.text
        spoken.remove(step.clock)
    expected = {
        "route": [step.hands, step.moves, round(step.height, 2), abs(step.steepness_deg)],
        "steepness": [abs(step.steepness_deg)],
    }.get(step.kind, [round(step.height, 2)] if step.hold and step.kind != "out_of_reach" else [])
    if step.kind in ("match", "foot_off"):
        expected = []
    assert all(one in expected for one in spoken), sentence.text


@pytest.mark.parametrize("detail", DETAILS)
@pytest.mark.parametrize("language", LANGUAGES)
def test_each_kind_of_step_has_a_sentence(language: Language, detail: Detail) -> None:
    for kind in get_args(StepKind):
        for other in ("left_hand", "right_hand"):
            step = Step(
                kind=kind, limb="left_hand", origin=other, hold=1, clock=1, distance=0.4,
                height=1.0, apart=0.5, steepness_deg=20, name="Blue 2", hands=2, moves=1,
            )  # fmt: skip
            for sentence in sentences_of((step,), Wording(language, detail)):
                assert re.fullmatch(r"[^{}]*[^{}\s][.!]", sentence.text), sentence.text
                assert "  " not in sentence.text
                assert 0.5 < sentence.speech < 12


def test_all_languages_have_the_same_messages() -> None:
    folder = Path(walltopo_climb.description.__file__).parent / "locales"

    def messages(language: str) -> set[str]:
        parsed = FluentParser().parse((folder / f"{language}.ftl").read_text(encoding="utf-8"))
        assert not [one for one in parsed.body if isinstance(one, syntax.Junk)]
        return {one.id.name for one in parsed.body if isinstance(one, syntax.Message)}

    own = {"type-on", "start_with_both-full"}  # of languages with cases or without
    english = messages("en")
    for language in LANGUAGES:
        assert messages(language) ^ english <= own


def test_plural_forms() -> None:
    def spoken(language: Language, moves: int) -> str:
        step = Step(kind="route", name="Blue", hands=9, moves=moves, height=3.0)
        return sentences_of((step,), Wording(language, "short"))[0].text

    assert spoken("en", 1) == "Blue: 1 hand move."
    assert spoken("en", 2) == "Blue: 2 hand moves."
    assert spoken("de", 1) == "Blue: 1 Zug mit den Händen."
    assert spoken("cs", 3) == "Blue: 3 kroky rukama."
    assert spoken("cs", 5) == "Blue: 5 kroků rukama."
    assert spoken("fr", 2) == "Blue : 2 mouvements de main."


def test_a_short_body_does_not_reach_the_top() -> None:
    holds, route, _ = flat_wall(0)
    far = [*holds[:-1], moved_up(holds[-1], 3.0)]
    steps = steps_of(route, far, 1.3)
    assert steps[-1].kind == "out_of_reach"
    unmoved = ClimberRow(climber="you", height=1.0, span=1.0, reached=False, crux=0, moves=())
    with pytest.raises(InputError, match=r"start of Test is out of reach at a height of 1\.00 m"):
        route_steps(route, unmoved, holds, 1.0)


def moved_up(hold: Hold, up: float) -> Hold:
    x, y, z = hold.position
    return Hold(id=hold.id, kind=hold.kind, type=hold.type, position=(x, y, z + up), size=0.1,
                normal=hold.normal, steepness_deg=hold.steepness_deg)  # fmt: skip


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    holds, route, _ = flat_wall(3)
    folder = ScanFolder(tmp_path)
    Holds(metric=False, holds=tuple(holds)).save(folder.holds)
    unmarked = Route(2, colour="blue", holds=route.holds)
    Routes(routes=(route, unmarked)).save(folder.routes)
    return tmp_path


def test_the_command(scan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", str(scan), "--route", "1", "--language", "de"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("Test: 9 Griffe für die Hände")
    assert "distances and heights are estimated" in text.replace("\n", " ")
    assert main(["describe", str(scan), "--route", "1", "--format", "json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert (row["route"], row["metric"]) == (1, False)
    assert row["sentences"][0]["text"].startswith("Test: 9 hand holds")
    assert main(["describe", str(scan), "--route", "7"]) != 0
    error = capsys.readouterr().err.replace("\n", " ")
    assert "no route has the number 7" in error
    assert "Its routes: 1, 2." in error
    assert main(["describe", str(scan), "--route", "2"]) != 0
    assert "Blue 2 has no start, no top" in capsys.readouterr().err
