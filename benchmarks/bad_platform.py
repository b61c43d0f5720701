"""The platform's answers to well-formed input with a wrong meaning.

The platform's own tests run the cases, because the lab does not import the platform; each case
names its test. The sentences come from the platform's language file.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
_MESSAGES: Final = ROOT / "gym/src/walltopo_gym/messages/en.json"

PLATFORM_HEAD: Final = """\

## The platform

Each row has a test of the platform (`benchmarks/bad_platform.py` names it).

| given | answer |
|---|---|
"""


@dataclass(frozen=True)
class PlatformCase:
    """One kind of input.

    Parameters
    ----------
    given : the input, as named in the table.
    test : file below gym/ and name of the test.
    answer : what happens, in words; or, with `keys`, the status alone.
    keys : of the sentences that are shown; values : their placeholders.
    """

    given: str
    test: tuple[str, str]
    answer: str
    keys: tuple[str, ...] = ()
    values: dict[str, object] = field(default_factory=dict)


_CUPS: Final = "tests/competitions/test_gym_competitions.py"
_MAIL: Final = "tests/server/test_gym_mail.py"
_ROUTES: Final = "tests/publishing/test_gym_publish.py"
_TICKS: Final = "tests/climbing/test_gym_ascents.py"
_TABLES: Final = "tests/test_gym_spreadsheets.py"
_DATABASE: Final = "tests/database/test_gym_database.py"
_ACCOUNTS: Final = "tests/accounts/test_gym_accounts.py"

PLATFORM_CASES: Final = (
    PlatformCase(
        "a list with `sep=;`, empty columns or CR line ends",
        (_CUPS, "test_lists_as_spreadsheets_write_them"),
        "read",
    ),
    PlatformCase(
        "a start list twice, the second time with letters in NFD",
        (_CUPS, "test_the_same_start_list_twice_adds_nobody_twice"),
        "lines that are there already are counted, not added",
    ),
    PlatformCase(
        "a list with letters that nobody can read any more",
        (_CUPS, "test_lists_that_lost_something_are_refused"),
        "422",
        ("table-letters", "table-send-file"),
    ),
    PlatformCase(
        "a list with a cell beside the named columns",
        (_CUPS, "test_lists_that_lost_something_are_refused"),
        "422",
        ("table-no-column", "table-head"),
        {"number": 4},
    ),
    PlatformCase(
        "an export opened in German, French or Czech Excel",
        (_TABLES, "test_numbers_stay_numbers_in_the_spreadsheets_of_a_language"),
        "a byte order mark, `;` between columns, decimal commas; the lists read it again",
    ),
    PlatformCase(
        "a password in NFC at first, in NFD later",
        (_ACCOUNTS, "test_a_password_is_the_same_however_a_keyboard_composes_it"),
        "the same password",
    ),
    PlatformCase(
        "a search word in NFD",
        ("tests/reset_plans/test_gym_reset_plans.py", "test_people_to_name"),
        "finds names in NFC",
    ),
    PlatformCase(
        "an SMTP password with `/`, `#`, `?`, `%` or an umlaut; an IDN domain",
        (_MAIL, "test_any_password_signs_in_and_the_mail_is_complete"),
        "the mail is sent, with Date and Message-ID",
    ),
    PlatformCase(
        "a wrong SMTP password",
        (_MAIL, "test_the_doctor_signs_in_to_the_mail_server"),
        "`walltopo gym doctor` signs in and reports the server's refusal",
    ),
    PlatformCase(
        "a dropped folder, files that are gone or hidden",
        ("web/tests/scans/dropped.test.mjs", "hidden files, and files that are gone, are left out"),
        "the folder is walked; such files are left out, the others are uploaded",
    ),
    PlatformCase(
        "a grade removed while routes have it",
        (_ROUTES, "test_renamed_grades_carry_over_and_used_ones_stay"),
        "409",
        ("grades-in-use", "grades-say-new"),
        {"grade": "blue", "uses": 2},
    ),
    PlatformCase(
        "a grade system deleted while routes have it",
        (_ROUTES, "test_renamed_grades_carry_over_and_used_ones_stay"),
        "409",
        ("grades-system-in-use", "grades-replace"),
        {"name": "Colours", "uses": 2},
    ),
    PlatformCase(
        "`6a`, `6a+ / 6B`, `v4/5`, `6+` of UIAA",
        (_ROUTES, "test_a_written_grade_gets_the_label_of_its_system"),
        "the label of the gym's system: 6A, 6A+/6B, V4-5, VI+",
    ),
    PlatformCase(
        "a grade that the system does not have",
        (_ROUTES, "test_a_written_grade_gets_the_label_of_its_system"),
        "422",
        ("grade-unknown", "grade-known"),
        {"system": "Font", "grade": "6Z", "grades": "6A, 6A+"},
    ),
    PlatformCase(
        "an `address` with a path, or without https",
        (_MAIL, "test_an_address_that_cannot_be_served_is_refused"),
        "with a path the server does not start; without https the doctor and the sign-in page say "
        "that browsers keep no sign-in",
    ),
    PlatformCase(
        "a database of a newer version",
        (_DATABASE, "test_the_doctor_says_which_version_made_the_database"),
        "a newer version of walltopo-gym made it: Install that version, or restore a backup that "
        "this version made.",
    ),
    PlatformCase(
        "an ascent of 1970",
        (_TICKS, "test_an_ascent_of_an_impossible_day_is_refused"),
        "422",
        ("ascent-too-early", "ascent-check-day"),
        {"day": "1970-01-01", "since": "2026-03-01"},
    ),
    PlatformCase(
        "an ascent of next week",
        (_TICKS, "test_an_ascent_of_an_impossible_day_is_refused"),
        "422",
        ("ascent-in-future", "ascent-check-clock"),
        {"day": "2026-03-08"},
    ),
    PlatformCase(
        "a refused ascent among others that wait in the phone",
        (
            "web/tests/outbox/outbox.test.mjs",
            "an ascent of an impossible day is kept with the "
            "reason, blocks no other, and can be withdrawn",
        ),
        "kept under *Not synced yet* with the reason; the others are sent",
    ),
    PlatformCase(
        "a competition's time read in another country",
        ("web/tests/shell/zones.test.mjs", "a competition's time is the gym's, and says its zone"),
        "shown by the gym's clock, with its zone: 18:00 CET",
    ),
)


def platform_rows() -> list[str]:
    """Return the table rows of all cases."""
    sentences: dict[str, str] = json.loads(_MESSAGES.read_text("utf-8"))
    return [_row(case, sentences) for case in PLATFORM_CASES]


def _row(case: PlatformCase, sentences: dict[str, str]) -> str:
    shown = [_filled(sentences[key], case.values) for key in case.keys]
    answer = f"{case.answer}: {' / '.join(shown)}" if shown else case.answer
    return f"| {case.given} | {answer} |"


def _filled(sentence: str, values: dict[str, object]) -> str:
    return re.sub(r"\{(\w+)\}", lambda place: str(values[place[1]]), sentence)
