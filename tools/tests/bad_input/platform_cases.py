"""The platform's answers to well-formed input with a wrong meaning.

The platform's own tests run the cases; each case names its test. The sentences come from the
platform's language file.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

GYM: Final = Path(__file__).parents[3] / "gym"


@dataclass(frozen=True)
class PlatformCase:
    """One kind of input.

    Parameters
    ----------
    given : the input, as named on the page.
    file : file of the test, below gym/.
    test : name of the test.
    answer : what happens, in words; or, with `keys`, the status alone.
    keys : of the sentences that are shown; values : their placeholders.
    """

    given: str
    file: str
    test: str
    answer: str
    keys: tuple[str, ...] = ()
    values: dict[str, object] = field(default_factory=dict)


def answer_of(case: PlatformCase) -> str:
    """Return the answer, with the sentences that are shown."""
    sentences = json.loads((GYM / "src/walltopo_gym/messages/en.json").read_text("utf-8"))
    shown = (
        re.sub(r"\{(\w+)\}", lambda place: str(case.values[place[1]]), sentences[key])
        for key in case.keys
    )
    return f"{case.answer}: {' / '.join(shown)}" if case.keys else case.answer


CUPS: Final = "tests/competitions/test_gym_competitions.py"
MAIL: Final = "tests/server/test_gym_mail.py"
ROUTES: Final = "tests/publishing/test_gym_publish.py"
TICKS: Final = "tests/climbing/test_gym_ascents.py"
TABLES: Final = "tests/test_gym_spreadsheets.py"
DATABASE: Final = "tests/database/test_gym_database.py"
ACCOUNTS: Final = "tests/accounts/test_gym_accounts.py"

# A row each.
# fmt: off
PLATFORM_CASES: Final = (
    PlatformCase("a list with `sep=;`, empty columns or CR line ends", CUPS, "test_lists_as_spreadsheets_write_them", "read"),
    PlatformCase("a start list twice, the second time with letters in NFD", CUPS, "test_the_same_start_list_twice_adds_nobody_twice", "lines that are there already are counted, not added"),
    PlatformCase("a list with letters that nobody can read any more", CUPS, "test_lists_that_lost_something_are_refused", "422", ("table-letters", "table-send-file")),
    PlatformCase("a list with a cell beside the named columns", CUPS, "test_lists_that_lost_something_are_refused", "422", ("table-no-column", "table-head"), {"number": 4}),
    PlatformCase("an export opened in German, French or Czech Excel", TABLES, "test_numbers_stay_numbers_in_the_spreadsheets_of_a_language", "a byte order mark, `;` between columns, decimal commas; the lists read it again"),
    PlatformCase("a password in NFC at first, in NFD later", ACCOUNTS, "test_a_password_is_the_same_however_a_keyboard_composes_it", "the same password"),
    PlatformCase("a search word in NFD", "tests/reset_plans/test_gym_reset_plans.py", "test_people_to_name", "finds names in NFC"),
    PlatformCase("an SMTP password with `/`, `#`, `?`, `%` or an umlaut; an IDN domain", MAIL, "test_any_password_signs_in_and_the_mail_is_complete", "the mail is sent, with Date and Message-ID"),
    PlatformCase("a wrong SMTP password", MAIL, "test_the_doctor_signs_in_to_the_mail_server", "`walltopo gym doctor` signs in and reports the server's refusal"),
    PlatformCase("a dropped folder, files that are gone or hidden", "web/tests/scans/dropped.test.mjs", "hidden files, and files that are gone, are left out", "the folder is walked; such files are left out, the others are uploaded"),
    PlatformCase("a grade removed while routes have it", ROUTES, "test_renamed_grades_carry_over_and_used_ones_stay", "409", ("grades-in-use", "grades-say-new"), {"grade": "blue", "uses": 2}),
    PlatformCase("a grade system deleted while routes have it", ROUTES, "test_renamed_grades_carry_over_and_used_ones_stay", "409", ("grades-system-in-use", "grades-replace"), {"name": "Colours", "uses": 2}),
    PlatformCase("`6a`, `6a+ / 6B`, `v4/5`, `6+` of UIAA", ROUTES, "test_a_written_grade_gets_the_label_of_its_system", "the label of the gym's system: 6A, 6A+/6B, V4-5, VI+"),
    PlatformCase("a grade that the system does not have", ROUTES, "test_a_written_grade_gets_the_label_of_its_system", "422", ("grade-unknown", "grade-known"), {"system": "Font", "grade": "6Z", "grades": "6A, 6A+"}),
    PlatformCase("an `address` with a path, or without https", MAIL, "test_an_address_that_cannot_be_served_is_refused", "with a path the server does not start; without https the doctor and the sign-in page say that browsers keep no sign-in"),
    PlatformCase("a database of a newer version", DATABASE, "test_the_doctor_says_which_version_made_the_database", "a newer version of walltopo-gym made it: Install that version, or restore a backup that this version made."),
    PlatformCase("an ascent of 1970", TICKS, "test_an_ascent_of_an_impossible_day_is_refused", "422", ("ascent-too-early", "ascent-check-day"), {"day": "1970-01-01", "since": "2026-03-01"}),
    PlatformCase("an ascent of next week", TICKS, "test_an_ascent_of_an_impossible_day_is_refused", "422", ("ascent-in-future", "ascent-check-clock"), {"day": "2026-03-08"}),
    PlatformCase("a refused ascent among others that wait in the phone", "web/tests/outbox/outbox.test.mjs", "an ascent of an impossible day is kept with the reason, blocks no other, and can be withdrawn", "kept under *Not synced yet* with the reason; the others are sent"),
    PlatformCase("a competition's time read in another country", "web/tests/shell/zones.test.mjs", "a competition's time is the gym's, and says its zone", "shown by the gym's clock, with its zone: 18:00 CET"),
)
# fmt: on
