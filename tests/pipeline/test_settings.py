"""Settings: sources, types, bounds and the words for mistakes."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from walltopo.core import InputError, SettingsError, WalltopoError
from walltopo.pipeline.settings import (
    SECTIONS,
    Settings,
    load_settings,
    sections,
)


def test_file_then_overrides(tmp_path: Path) -> None:
    file = tmp_path / "walltopo.toml"
    file.write_text("[ingest]\nmin_side = 200\nmax_aspect = 3\n")
    settings = load_settings(file, ["ingest.min_side=100"])
    assert (settings.ingest.min_side, settings.ingest.max_aspect) == (100, 3.0)
    assert isinstance(settings.ingest.max_aspect, float)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ingest.min_sde=100", "Did you mean ingest.min_side"),
        ("lift.treshold=0.4", "Did you mean lift.threshold"),
        ("nonsense=1", "unknown setting"),
        ("ingest.min_side", "expected KEY=VALUE"),
        ("ingest.min_side=tall", "expected int, got 'tall'"),
        ("ingest.min_side=1.5", "expected int, got 1.5"),
        ("ingest.min_side=true", "expected int, got True"),
        ("ingest.min_side=1", "expected at least 64, got 1"),
        ("ingest.max_aspect=nan", "finite"),
    ],
)
def test_mistakes_are_explained(text: str, message: str) -> None:
    with pytest.raises(SettingsError) as caught:
        load_settings(None, [text])
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("content", "kind", "message"),
    [
        ("[ingest", InputError, "not valid TOML"),
        ("a = " + "[" * 100_000, InputError, "nested too deeply"),
        ("[lift]\nthreshold = " + "9" * 5000, InputError, "not valid TOML"),
        ("min_side = 3", SettingsError, "stands outside a section"),
    ],
    ids=["cut", "deep", "digits", "section"],
)
def test_bad_files_are_named(
    tmp_path: Path, content: str, kind: type[WalltopoError], message: str
) -> None:
    file = tmp_path / "w.toml"
    file.write_text(content)
    with pytest.raises(kind, match=message) as caught:
        load_settings(file)
    assert str(file) in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        load_settings(tmp_path / "none.toml")


def test_every_setting_is_documented_and_survives_a_round_trip() -> None:
    assert tuple(sections()) == SECTIONS
    assert [
        field for fields in sections().values() for field in fields.values() if not field.text
    ] == []
    assert Settings().as_dict()["ingest"]["min_side"] == 320


def test_settings_of_an_older_scan_get_the_sections_that_they_lack() -> None:
    known = msgspec.convert({"export": {"title": "Cave"}}, Settings)
    assert known.as_dict() == {**Settings().as_dict(), "export": known.as_dict()["export"]}
