"""Every option of every command: numbers within bounds, no file replaced unasked."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import pytest

from walltopo.cli import build_parser, leaf_parsers, main
from walltopo.cli.options import Number, options_given
from walltopo.core import SettingsError
from walltopo.pipeline.settings import load_settings, sections
from walltopo.segment.lift.settings import LiftParams

# These write what the user names as an argument; the others by `-o`, `--out` or `--output`.
BY_ARGUMENT = {
    "gym backup",
    "synth",
    "train paint",
    "train two-colours",
    "dataset convert",
    "dataset split",
}
# `scan` guards its folder itself (pipeline/workplace.py).
GUARDED = {"scan", "import"}


def _parsers(
    parser: argparse.ArgumentParser, words: tuple[str, ...] = ()
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Every command and its parser."""
    below = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    if not below:
        yield " ".join(words), parser
    for action in below:
        inner: argparse.ArgumentParser
        for name, inner in (action.choices or {}).items():
            # `train` is read by one of four parsers, chosen by its first word.
            for word, other in getattr(inner, "_others", {}).items():
                yield f"{name} {word}", other
            yield from _parsers(getattr(inner, "_detector", None) or inner, (*words, name))


COMMANDS = dict(_parsers(build_parser()))


def _numbers() -> Iterator[tuple[str, argparse.Action]]:
    for command, parser in COMMANDS.items():
        for action in parser._actions:
            if isinstance(action.type, Number) or action.type in (int, float):
                yield command, action


def test_every_number_is_checked() -> None:
    found = list(_numbers())
    assert len(found) > 80
    unchecked = [f"{command} {a.dest}" for command, a in found if not isinstance(a.type, Number)]
    assert unchecked == []


@pytest.mark.parametrize(
    "text", ["nan", "inf", "-inf", "1e400", "1e300", "9" * 30, "9" * 5000, "-" + "9" * 30, "", "x"]
)
def test_no_number_is_beyond_all_bounds(text: str) -> None:
    for _, action in _numbers():
        assert isinstance(action.type, Number)
        with pytest.raises(argparse.ArgumentTypeError, match="expected"):
            action.type(text)


@pytest.mark.parametrize(
    "words",
    [
        ["view", "scan", "--port", "99999"],
        ["view", "scan", "--port", "-1"],
        ["export", "scan", "--route", "-1"],
        ["measure", "print", "-o", "p.pdf", "--number", "0"],
        ["measure", "print", "-o", "p.pdf", "--number", "99"],
        ["lift", "--mesh=m", "--cameras=c", "--masks=m", "-o=o", "--refine-borders=99"],
        ["lift", "--mesh=m", "--cameras=c", "--masks=m", "-o=o", "--threshold=nan"],
        ["detect", "p", "-o", "o", "--score", "nan"],
        ["scan", "p", "-o", "o", "--set", "lift.threshold=nan"],
        ["scan", "p", "-o", "o", "--set", "lift.threshold=" + "9" * 5000],
        ["scan", "p", "-o", "o", "--set", "lift.threshold=" + "[" * 100_000],
        ["synth", "g", "--seed", "-1"],
        ["synth", "g", "--photos", "0"],
        ["evaluate", "scan", "s", "--truth", "t", "--distance", "inf"],
        ["tune", "lift", "w.toml", "-o", "t", "--workers", "-3"],
        ["dataset", "split", "s", "t", "--parts", "../../x=1"],
        ["dataset", "split", "s", "t", "--parts", "train=nan"],
        ["dataset", "split", "s", "t", "--parts", "train=-1,valid=2"],
    ],
    ids=lambda words: " ".join(words)[:60],
)
def test_impossible_numbers_are_wrong_usage(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        code: object = main(words)
    except SystemExit as error:
        code = error.code
    assert code == 2
    assert list(tmp_path.iterdir()) == []


def test_every_command_that_writes_asks_before_it_replaces() -> None:
    flags = {name: set(parser._option_string_actions) for name, parser in COMMANDS.items()}
    writing = {name for name, given in flags.items() if given & {"-o", "--out", "--output"}}
    asking = {name for name, given in flags.items() if "--overwrite" in given}
    assert asking == writing - GUARDED | BY_ARGUMENT
    assert len(asking) > 20


def test_a_found_settings_file_names_no_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "walltopo.toml"
    (tmp_path / "photos").mkdir()
    words = ["scan", "photos", "-o", "scan"]
    leads = [(s, n) for s, fields in sections().items() for n, f in fields.items() if f.program]
    assert ("dense", "openmvs_bin") in leads
    for section, name in leads:
        file.write_text(f'[{section}]\n{name} = "here"\n')
        assert main(words) == 2
        output = " ".join(capsys.readouterr().err.split())
        assert f"walltopo.toml: {section}.{name}" in output
        # The user's own word: the file named, or the setting.
        assert main([*words, "--config", "walltopo.toml"]) == 3  # goes on: no photos
        file.write_text("")
        assert main([*words, "--set", f"{section}.{name}=here"]) == 3


def test_every_setting_that_leads_to_a_program_is_known() -> None:
    """A new path setting must say whether what it leads to is run."""
    named = {
        f"{section}.{name}"
        for section, fields in sections().items()
        for name, field in fields.items()
        if name.endswith(("_bin", "weights", "program", "command", "plugin"))
    }
    marked = {
        f"{section}.{name}"
        for section, fields in sections().items()
        for name, field in fields.items()
        if field.program
    }
    assert named == marked


def test_harmless_settings_of_a_found_file_count(tmp_path: Path) -> None:
    file = tmp_path / "walltopo.toml"
    file.write_text('[lift]\nthreshold = 0.5\n[dense]\nopenmvs_bin = ""\n')
    assert load_settings(file, programs=False).lift.threshold == 0.5
    file.write_text('[dense]\nopenmvs_bin = "x"\n')
    with pytest.raises(SettingsError, match="leads to a program"):
        load_settings(file, programs=False)


@pytest.mark.parametrize(
    ("content", "output"),
    [
        (b"a = '\xff'", "not valid TOML"),
        (b"a = " + b"[" * 100_000, "nested too deeply"),
        (None, "cannot"),
    ],
    ids=["not UTF-8", "deep", "folder"],
)
def test_settings_files_that_cannot_be_read(
    content: bytes | None, output: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "config"
    if content is None:
        config.mkdir()
    else:
        config.write_bytes(content)
    assert main(["scan", "p", "-o", str(tmp_path / "scan"), "--config", str(config)]) == 3
    assert output in " ".join(capsys.readouterr().err.split())


def test_every_command_has_the_common_options() -> None:
    found = list(leaf_parsers(build_parser()))
    assert len(found) > 25
    for parser in found:
        if parser.get_default("distribution"):  # not installed: its options are not known
            continue
        assert {"--verbose", "--quiet"} <= parser._option_string_actions.keys(), parser.prog


def test_a_quiet_command_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--quiet"]) in (0, 5)
    assert capsys.readouterr().out == ""
    assert main(["doctor"]) in (0, 5)
    assert capsys.readouterr().out != ""


def test_a_setting_for_experts_is_reached_by_set() -> None:
    given = ["lift", "--mesh=m", "--cameras=c", "--masks=m", "-o=o"]
    args = build_parser().parse_args([*given, "--set", "cohesion=0.4", "--set", "voters=all"])
    params = options_given(args, LiftParams)
    assert (params.cohesion, params.voters, params.threshold) == (0.4, "all", 0.5)
    for word, part in (("cohesoin=0.4", "Did you mean cohesion"), ("cohesion=2", "at most")):
        args = build_parser().parse_args([*given, "--set", word])
        with pytest.raises(SettingsError) as failure:
            options_given(args, LiftParams)
        assert part in f"{failure.value} {failure.value.hint}"


def test_the_settings_that_are_shown_fit_on_a_screen() -> None:
    shown = [field for fields in sections().values() for field in fields.values()]
    assert sum(not field.expert for field in shown) <= 25
