"""No text of a stranger begins a line of the log or reaches the operator's terminal as it is."""

from __future__ import annotations

import logging
import logging.config
import re
from collections.abc import Callable, Iterator
from typing import Any, Literal

import pytest
from gym.tests.worlds import Server
from hypothesis import given
from hypothesis import strategies as st

from walltopo_gym.log_lines import escape_line, traceback_of
from walltopo_gym.mail import ConsoleMailer, Mail
from walltopo_gym.server.request_log import log_config

FORGED = "\n2026-01-01 00:00:00,000 INFO walltopo_gym.a owner\x1b[2J\r\u2028\u202e\x85"
_OURS = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} [A-Z]+ [\w.]+ ")


@pytest.fixture
def log(capsys: pytest.CaptureFixture[str]) -> Iterator[Callable[[Literal["plain", "json"]], None]]:
    """Configure logging as the server does; put back what was there before."""
    root = logging.getLogger()
    names = ("walltopo_gym", "uvicorn", "dbos")
    loggers = [root, *(logging.getLogger(name) for name in names)]
    before = [(one, one.handlers[:], one.level, one.propagate) for one in loggers]
    yield lambda kind: logging.config.dictConfig(log_config(kind))
    for one, handlers, level, propagate in before:
        one.handlers[:], one.propagate = handlers, propagate
        one.setLevel(level)


def _lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return what stands in the log, as a terminal and a reader of lines separate it."""
    text = capsys.readouterr().err
    assert text.replace("\n", "").isprintable()
    return text.splitlines()


def test_a_path_is_logged_as_it_was_sent(
    server: Server, log: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    log("plain")
    path = "/g/a%0a2026-01-01%20INFO%20forged%1b%5b2J%e2%80%a8"
    server.client().get(path + "?secret=1")
    [line] = [line for line in _lines(capsys) if "/g/a" in line]
    assert f"GET {path} " in line
    assert "secret" not in line


@pytest.mark.parametrize("name", ["walltopo_gym.scans", "uvicorn.error", "dbos", "some.library"])
def test_a_message_is_one_line(name: str, log: Any, capsys: pytest.CaptureFixture[str]) -> None:
    log("plain")
    logging.getLogger(name).warning("%s: cannot be read", f"a.jpg{FORGED}")
    [line] = _lines(capsys)
    assert _OURS.match(line)
    assert r"a.jpg\n2026-01-01" in line
    assert r"\x1b[2J\r\u2028\u202e\x85: cannot be read" in line


def test_a_traceback_can_be_read_and_forges_no_line(
    log: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    log("plain")
    try:
        try:
            raise KeyError(FORGED)
        except KeyError as error:
            raise ExceptionGroup(FORGED, [ValueError(FORGED)]) from error
    except ExceptionGroup:
        logging.getLogger("walltopo_gym").exception("a defect")
    first, *rest = _lines(capsys)
    assert _OURS.match(first)
    assert all(line.startswith("    ") for line in rest)
    # The frames have their lines, with the source code.
    assert any(line.strip().startswith(f'File "{__file__}"') for line in rest)
    assert any(line.strip() == "raise KeyError(FORGED)" for line in rest)
    assert any("The above exception was the direct cause" in line for line in rest)
    assert any(line.strip(" |").startswith(r"ValueError: \n") for line in rest)


def test_a_mail_in_the_log_can_be_read_and_forges_no_line(
    log: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    log("plain")
    link = "https://walls.example.com/sign-up#secret"
    ConsoleMailer().send(Mail(f"a@example.com{FORGED}", "Welcome", f"Hello,\n\n{link}\n{FORGED}"))
    first, *rest = _lines(capsys)
    assert _OURS.match(first)
    assert link in [line.strip() for line in rest]
    assert all(line.startswith("    ") for line in rest)


def test_json_has_one_line_a_record(log: Any, capsys: pytest.CaptureFixture[str]) -> None:
    log("json")
    logging.getLogger("walltopo_gym").warning("%s", FORGED)
    assert len(_lines(capsys)) == 1


@given(st.text())
def test_any_text_is_one_printable_line(text: str) -> None:
    assert escape_line(text).isprintable()
    assert escape_line(text) == text or not text.isprintable()
    assert traceback_of(ValueError(text)).replace("\n", "").isprintable()
