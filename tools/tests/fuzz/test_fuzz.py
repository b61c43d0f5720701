"""Damaged files: every kept one, wrong values in every place, and a round of new damage."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator

import pytest
from benchmarks.fuzz import fuzz, kept
from tools.fuzz.mutate import WRONG, damaged, places, replaced
from tools.fuzz.targets import TARGETS, seeds
from tools.fuzz.watched import Outcome, Watched

ROUNDS = 150  # of damage a target: with all else here under two minutes on one core
EACH = 6  # wrong values take turns: all of them, but not each in each place


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    with Watched() as process:
        yield process


@pytest.mark.parametrize("target", TARGETS)
def test_kept_files_are_read_or_refused(watched: Watched, target: str) -> None:
    outcomes = {name: watched.read(target, files) for name, files in kept(target).items()}
    assert {name: outcome for name, outcome in outcomes.items() if outcome.bad} == {}


@pytest.mark.parametrize("target", TARGETS)
def test_whole_files_are_read(watched: Watched, target: str) -> None:
    for files in seeds(target):
        assert watched.read(target, files) == Outcome("read", "")


@pytest.mark.parametrize("target", TARGETS)
def test_new_damage_is_read_or_refused(watched: Watched, target: str) -> None:
    run = fuzz(watched, target, 0, itertools.chain(itertools.repeat(True, ROUNDS), [False]))
    assert run.finds == {}
    assert run.counts.total() == ROUNDS
    assert run.counts["refused"] > ROUNDS / 20  # the damage does damage


@pytest.mark.parametrize(
    ("target", "number", "name"),
    [
        (target, number, name)
        for target in ("coco", "sets", "transforms", "painted", "documents", "edits")
        for number, files in enumerate(seeds(target))
        for name in files
        if name.endswith(".json")
    ],
)
def test_a_wrong_value_in_any_place_is_read_or_refused(
    watched: Watched, target: str, number: int, name: str
) -> None:
    files = seeds(target)[number]
    whole = json.loads(files[name])
    found: dict[str, str] = {}
    for k, way in enumerate(places(whole)):
        for wrong in WRONG[k % EACH :: EACH]:
            text = json.dumps(replaced(whole, way, wrong)).encode()
            outcome = watched.read(target, files | {name: text})
            if outcome.bad:
                found[f"{way} = {wrong!r}"] = outcome.text
    assert found == {}


def test_damage_is_the_same_for_the_same_seed() -> None:
    for target in TARGETS:
        whole = seeds(target)
        assert damaged(whole[0], whole, 7) == damaged(whole[0], whole, 7)


class TestWatched:
    """The watch itself: what it must notice, it notices."""

    @pytest.mark.parametrize(
        ("what", "kind"),
        [
            ("raise ValueError('x')", "defect"),
            ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "crash"),
            ("bytearray(3 << 30)", "defect"),
            ("(folder.parent / 'stray').write_text('x')", "defect"),
            ("while True: pass", "hang"),
        ],
    )
    def test_finds(
        self, watched: Watched, monkeypatch: pytest.MonkeyPatch, what: str, kind: str
    ) -> None:
        monkeypatch.setattr("tools.fuzz.watched.MAX_WAIT", 600.0)
        with monkeypatch.context() as patch:
            if kind == "hang":  # what ends gets the usual time: an import can take a second
                patch.setattr("tools.fuzz.watched.MAX_SECONDS", 1.0)
            assert watched.read("probe", {"code.py": what.encode()}).kind == kind
        assert watched.read("probe", {"code.py": b""}).kind == "read"  # a new one takes over
