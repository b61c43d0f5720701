"""Exports of other services are read as people get them there."""

from __future__ import annotations

import json
from datetime import UTC, date, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo_gym.climbing_log.importing.documents import toplogger_grade
from walltopo_gym.climbing_log.importing.lines import parse_day
from walltopo_gym.climbing_log.importing.reading import MAX_LINES, read_log
from walltopo_gym.climbing_log.models import MAX_NOTE
from walltopo_gym.errors import RequestError

EIGHT_A = (
    '"route_boulder","name","location_name","sector_name","area_name","country_code","date",'
    '"type","sub_type","rating","project","tries","repeats","difficulty","perceived_hardness",'
    '"comment","height","recommended","sits"\n'
    'ROUTE,"Silbergeier, left","Rätikon","Unknown Sector",null,CHE,2023-07-08T00:00:00+00:00,os,'
    "null,4,0,0,0,8b+,hard,null,0,1,0\n"
    'BOULDER,"El ""Fuego""","Petrohrad","Kaple",null,CZE,2024-03-02T00:00:00+00:00,rp,null,3,0,7,'
    '0,7A+,null,"windy, cold\nand sharp",0,0,1\n'
    "ROUTE,Warm-up,Labak,,null,CZE,2024-04-01T00:00:00+00:00,tr,null,0,0,0,0,6a,null,null,0,0,0\n"
    "BOULDER,Dream,Petrohrad,,null,CZE,2024-04-02T00:00:00+00:00,go,null,0,1,12,0,8A,,,0,0,0\n"
)
THE_CRAG = (
    "Route Name,Ascent Label,Ascent ID,Ascent Link,Ascent Type,Route Grade,Ascent Grade,"
    "Route Gear Style,Ascent Gear Style,Route Height,Country,Crag Name,Crag Path,With,Comment,"
    "Quality,Ascent Date,Log Date,Shot\n"
    "Kauk,Kauk,6001,https://example.com/6001,Red point,7b,,Sport,,25m,Germany,Frankenjura,"
    "Frankenjura - Rodenstein,Eva,hard start,Classic,2022-05-14T00:00:00Z,2022-05-15T10:00:00Z,\n"
    "Slab,Slab,6002,https://example.com/6002,Top rope flash,18,17,Trad,Top rope,20m,Australia,"
    "Arapiles,Victoria - Arapiles,,,,2019-01-03T00:00:00Z,2019-01-04T00:00:00Z,\n"
    "Roof,Roof,6003,https://example.com/6003,Ghost,V5,,Boulder,,,Austria,Zillertal,,,,,"
    "2020-02-02T00:00:00Z,2020-02-02T00:00:00Z,\n"
    "Undated,Undated,6004,https://example.com/6004,Tick,V5,,Boulder,,,Austria,Zillertal,,,,,,"
    "2020-02-02T00:00:00Z,\n"
)
BOARDLIB = (
    "board,angle,climb_name,date,logged_grade,displayed_grade,is_benchmark,tries,is_mirror,"
    "sessions_count,tries_total,is_repeat,is_ascent,comment\n"
    "tension,40,trash bag better,2024-06-17 16:21:23,V3,V3,False,3,False,1,3,False,True,\n"
    "tension,40,Bumble,2024-06-17 16:28:23,V3,V3,False,1,True,1,1,False,True,\n"
    "kilter,45,Swooped,2024-06-18 18:00:00,,7a/V6,False,5,False,1,5,False,False,\n"
    "moon2019,25,Far from the Madding,2024-06-19,6B+,6B+,True,1,False,2,3,True,True,\n"
)
AURORA = {
    "user": {"username": "eva", "email_address": "eva@example.com"},
    "ascents": [
        {
            "climb": "Pistol Whip",
            "angle": 40,
            "count": 1,
            "stars": 3,
            "climbed_at": "2024-09-20 18:05:00",
            "created_at": "2024-09-20 18:05:01",
            "grade": "7a/V6",
        }
    ],
    "attempts": [
        {
            "climb": "Slab Master",
            "angle": 35,
            "count": 4,
            "climbed_at": "2024-09-20 18:15:00",
            "created_at": "2024-09-20 18:15:01",
        }
    ],
    "climbs": [{"name": "Mine", "layout": "Kilter Board Original", "holds": []}],
    "circuits": [],
}
MOON = {
    "Data": [
        {
            "Problem": {"Name": "Hard Times", "Grade": "6B+", "UserGrade": "6C"},
            "NumberOfTries": "Flashed",
            "DateClimbedAsString": "05 Sep 2023",
            "Comment": None,
        },
        {
            "Problem": {"Name": "To Hard", "Grade": "7A"},
            "NumberOfTries": "more than 3 tries",
            "DateClimbedAsString": "6 Sep 2023",
        },
        {
            "Problem": {"Name": "Some day", "Grade": "8A"},
            "NumberOfTries": "Project",
            "DateClimbedAsString": "06 Sep 2023",
        },
    ],
    "Total": 3,
}
TOPLOGGER = {
    "data": {
        "climbUsers": {
            "data": [
                {
                    "id": "77",
                    "tickType": 2,
                    "totalTries": 1,
                    "tickedFirstAtDate": "2025-02-03T18:30:00.000Z",
                    "holdColor": {"nameLoc": "Green"},
                    "climb": {
                        "climbType": "boulder",
                        "grade": 633,
                        "name": None,
                        "gym": {"name": "Monk"},
                    },
                }
            ]
        }
    }
}


def facts(text: str) -> list[tuple[Any, ...]]:
    """Name, location, grade, discipline, kind, tries and day of each climb."""
    return [
        (
            line.name,
            line.location,
            line.grade,
            line.discipline,
            line.kind,
            line.tries,
            line.climbed_at.date().isoformat(),
        )
        for line in read_log(text).lines
    ]


def test_8a() -> None:
    assert facts(EIGHT_A) == [
        ("Silbergeier, left", "Rätikon", "8b+", "lead", "onsight", 1, "2023-07-08"),
        ('El "Fuego"', "Petrohrad, Kaple", "7A+", "boulder", "top", 7, "2024-03-02"),
        ("Warm-up", "Labak", "6a", "top-rope", "top", 1, "2024-04-01"),
        ("Dream", "Petrohrad", "8A", "boulder", "try", 12, "2024-04-02"),
    ]
    assert read_log(EIGHT_A).lines[1].note == "windy, cold\nand sharp"


def test_the_crag() -> None:
    file = read_log(THE_CRAG)
    assert (file.source, facts(THE_CRAG)) == (
        "theCrag",
        [
            ("Kauk", "Frankenjura", "7b", "lead", "top", 1, "2022-05-14"),
            ("Slab", "Arapiles", "17", "top-rope", "flash", 1, "2019-01-03"),
        ],
    )
    # An unknown style and a missing day are named by line, not guessed.
    assert [(fault.line, fault.error.key) for fault in file.faults] == [
        (4, "log-style"),
        (5, "log-day"),
    ]


def test_boardlib() -> None:
    assert facts(BOARDLIB) == [
        ("trash bag better", "Tension 40°", "V3", "boulder", "top", 3, "2024-06-17"),
        ("Bumble", "Tension 40°", "V3", "boulder", "flash", 1, "2024-06-17"),
        ("Swooped", "Kilter 45°", "7a/V6", "boulder", "try", 5, "2024-06-18"),
        ("Far from the Madding", "Moon2019 25°", "6B+", "boulder", "repeat", 1, "2024-06-19"),
    ]


def test_an_older_boardlib() -> None:
    old = "board,angle,name,date,grade,tries,is_mirror\nkilter,40,Old one,2022-01-05,V4,2,False\n"
    assert facts(old) == [("Old one", "Kilter 40°", "V4", "boulder", "top", 2, "2022-01-05")]


def test_aurora() -> None:
    assert facts(json.dumps(AURORA)) == [
        ("Pistol Whip", "Kilter Board Original 40°", "7a/V6", "boulder", "flash", 1, "2024-09-20"),
        ("Slab Master", "Kilter Board Original 35°", "", "boulder", "try", 4, "2024-09-20"),
    ]


def test_moonboard() -> None:
    assert facts(json.dumps(MOON)) == [
        ("Hard Times", "MoonBoard", "6C", "boulder", "flash", 1, "2023-09-05"),
        ("To Hard", "MoonBoard", "7A", "boulder", "top", 4, "2023-09-06"),
        ("Some day", "MoonBoard", "8A", "boulder", "project", 1, "2023-09-06"),
    ]


def test_toplogger() -> None:
    assert facts(json.dumps(TOPLOGGER)) == [
        ("Green", "Monk", "6B", "boulder", "flash", 1, "2025-02-03")
    ]


@pytest.mark.parametrize(
    ("number", "grade"),
    [
        ("6.0", "6A"),
        ("6.17", "6A+"),
        ("683", "6C+"),
        ("7.67", "7C"),
        ("6+", "6+"),
        ("7a", "7a"),
        ("nan", "nan"),
        ("inf", "inf"),
        ("", ""),
    ],
)
def test_a_grade_of_toplogger(number: str, grade: str) -> None:
    assert toplogger_grade(number, is_boulder=True) == grade


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("2024-06-17", datetime(2024, 6, 17, 12, tzinfo=UTC)),
        ("2024-06-17T00:00:00Z", datetime(2024, 6, 17, 12, tzinfo=UTC)),
        ("2024-06-17 16:21:23", datetime(2024, 6, 17, 16, 21, 23, tzinfo=UTC)),
        ("2024-06-17T23:30:00-02:00", datetime(2024, 6, 18, 1, 30, tzinfo=UTC)),
        ("31 Feb 2024", None),
        ("1 Foo 2024", None),
        ("0001-01-01T00:00:00+14:00", None),
        ("yesterday", None),
    ],
)
def test_days(text: str, moment: datetime | None) -> None:
    assert parse_day(text) == moment


def test_a_separator_of_a_spreadsheet_and_windows_lines() -> None:
    table = "climbed_at;gym_name;route_name;grade;kind;tries;note\r\n"
    table += "2026-01-02T18:00:00+00:00;Halle;'=1+1;;zone;2;\r\n"
    assert facts("\ufeff" + table) == [("=1+1", "Halle", "", "", "try", 2, "2026-01-02")]


def test_a_text_that_is_too_long_is_shortened_and_marked() -> None:
    line = read_log(
        f"climbed_at,gym_name,route_name,kind,note\n2026-01-02,Hall,Moon,top,{'x' * 5_000}\n"
    ).lines[0]
    assert (len(line.note), line.note[-1], line.is_shortened) == (MAX_NOTE, "…", True)


@pytest.mark.parametrize("day", ["2199-01-01", "1812-06-24"])
def test_an_impossible_day_is_an_error_of_its_line(day: str) -> None:
    file = read_log(f"climbed_at,gym_name,route_name,kind\n{day},Hall,Moon,top\n")
    assert (file.lines, [fault.error.key for fault in file.faults]) == ([], ["log-day-range"])


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("", "log-unknown"),
        ("name,grade\nMoon,6a\n", "log-unknown"),
        ('{"user": {}}', "log-unknown"),
        ("[1, 2]", "log-unknown"),
        ("[" * 100_000, "log-damaged"),
        ('{"ascents": [', "log-damaged"),
        ('climbed_at,gym_name,kind\n"2026-01-02,Hall,top\n', "log-damaged"),
        (
            "climbed_at,gym_name,kind\n" + (MAX_LINES + 1) * "2026-01-02,Hall,top\n",
            "table-too-long",
        ),
    ],
)
def test_other_files_are_refused_in_words(text: str, key: str) -> None:
    with pytest.raises(RequestError) as refused:
        read_log(text)
    assert refused.value.key == key
    assert refused.value.hint


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(),
        lambda inner: (
            st.lists(inner, max_size=4)
            | st.dictionaries(
                st.sampled_from(
                    ["ascents", "attempts", "climbs", "Data", "Problem", "tickType", "climb", "gym"]
                ),
                inner,
                max_size=4,
            )
        ),
        max_leaves=20,
    )
)
def test_no_document_is_a_defect(document: object) -> None:
    try:
        file = read_log(json.dumps([document]))
        for line in file.lines:
            assert date(1900, 1, 1) <= line.climbed_at.date()
    except RequestError as refused:
        assert refused.message  # noqa: PT017 - any refusal in words will do
