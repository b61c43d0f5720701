"""The terminal shows foreign names and messages as text and never obeys them."""

from __future__ import annotations

import io
import logging
import os
import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.table import Table

from walltopo.cli import main
from walltopo.cli.console import Terminal, escape_controls
from walltopo.cli.listener import TerminalListener
from walltopo.cli.quiet import quiet_libraries
from walltopo.scans.manifest import StageRecord

HOSTILE = "a\x1b]0;title\x07\x1b[31m\x9b2J\x08\x7f\u202e[/red][bold]:smile:\udcff.jpg"
OBEYED = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\u202a-\u202e]")


def _shown(show: Callable[[Terminal], object], colours: bool = False) -> str:
    stream = io.StringIO()
    show(
        Terminal(
            file=stream,
            highlight=False,
            markup=False,
            emoji=False,
            width=400,
            force_terminal=colours,
            color_system="standard" if colours else None,
        )
    )
    return stream.getvalue()


def _as_table(console: Terminal) -> None:
    table = Table(HOSTILE, title=HOSTILE)
    table.add_row(HOSTILE)
    console.print(table)


def _as_progress(console: Terminal) -> None:
    with TerminalListener(console, verbose=True) as listener:
        listener.stage_begins(HOSTILE)
        listener.step(HOSTILE, 3)
        listener.note(HOSTILE)
        listener.detail(HOSTILE)
        listener.stage_ends(HOSTILE, StageRecord("done", metrics={"summary": HOSTILE}))
        listener.stage_kept(HOSTILE, StageRecord("done", metrics={HOSTILE: 1}))


@pytest.mark.parametrize(
    "show",
    [
        lambda console: console.print(HOSTILE),
        lambda console: console.print(HOSTILE, soft_wrap=True, style="red"),
        lambda console: console.out(HOSTILE),
        _as_table,
        _as_progress,
    ],
    ids=["print", "styled", "out", "table", "progress"],
)
def test_text_stays_text(show: Callable[[Terminal], object]) -> None:
    shown = _shown(show)
    assert not OBEYED.search(shown)
    assert "[/red][bold]:smile:" in shown
    assert r"\x1b[31m\x9b2J" in shown


def test_colours_of_our_own_are_kept() -> None:
    shown = _shown(lambda console: console.print("word \x1b[2J", style="red"), colours=True)
    assert shown == "\x1b[31mword \\x1b[2J\x1b[0m\n"


@given(st.text(st.characters()))
def test_what_is_visible_can_be_encoded_and_is_not_obeyed(text: str) -> None:
    shown = escape_controls(text)
    assert not OBEYED.search(shown)
    assert len(shown.encode()) >= len(text)
    assert escape_controls(shown) == shown


@pytest.mark.parametrize("words", [["status"], ["view"], ["mesh", "check"], ["export"]])
def test_a_path_with_markup_is_named_not_obeyed(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "[/red]\x1b[31m.ply"
    assert main([*words, str(path)]) == 3
    output = "".join(capsys.readouterr().err.split("\n"))
    assert r"[/red]\x1b[31m.ply" in output
    assert "\x1b" not in output


def test_a_name_that_is_not_utf8(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / os.fsdecode(b"gr\xf6sse")
    assert main(["status", str(path)]) == 3
    assert r"gr\udcf6sse" in capsys.readouterr().err


def test_wrong_usage_shows_what_was_typed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["status", "scan", "--\x1b[31mcolour"])
    assert caught.value.code == 2
    assert "\x1b" not in capsys.readouterr().err


def test_the_doctors_advice_is_whole(capsys: pytest.CaptureFixture[str]) -> None:
    main(["doctor"])
    output = "".join(capsys.readouterr().out.split())
    requests = re.findall(r"pipinstall'?([\w-]+)", output)
    assert requests.count("walltopo") == output.count("walltopo[")


def _noise() -> None:
    warnings.warn("of a library", RuntimeWarning, stacklevel=1)
    logging.getLogger("a.library").warning("of a library")


def test_libraries_are_quiet(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "warnoptions", [])
    with quiet_libraries(verbose=False):
        _noise()
    assert capsys.readouterr().err == ""


def test_verbose_shows_libraries(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "warnoptions", [])
    with quiet_libraries(verbose=True):
        warnings.simplefilter("always")
        warnings.warn("\x1b[31mof a library", RuntimeWarning, stacklevel=1)
    output = capsys.readouterr().err
    assert r"RuntimeWarning: \x1b[31mof a library" in " ".join(output.split())
