"""The search: it finds, resumes, refuses to mix, and says what it was tuned on."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import InputError, SettingsError
from walltopo.pipeline.settings import load_settings
from walltopo_lab.cli import tune as commands
from walltopo_lab.tune.report import merge_settings, write_report, write_slices
from walltopo_lab.tune.study import open_study, run_trials, study_results
from walltopo_lab.tune.task import Range
from walltopo_lab.tune.walls import read_walls


class Hill:
    """A hill at a = .7; b does nothing, and above .9 it is impossible."""

    section, figure = "routes", "height"
    fixed: Mapping[str, Any] = {}
    ranges: Sequence[Range] = (Range("a", 0, 1, 0.1), Range("b", 0, 1, 0.5, curve=2.0))

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        if values["b"] > 0.9:
            raise SettingsError("b is too large")
        return {"one": 1 - (values["a"] - 0.7) ** 2, "two": 1 - abs(values["a"] - 0.7)}


@pytest.mark.slow
def test_search_finds_resumes_and_explains(tmp_path: Path) -> None:
    storage, hill = f"sqlite:///{tmp_path / 's.db'}", Hill()
    run_trials(open_study(hill, storage, "hill", 0), hill, 12)
    again = open_study(hill, storage, "hill", 1)
    assert len(again.trials) == 12
    run_trials(again, hill, 18)
    run_trials(again, hill, 18)  # all done: nothing happens
    found = study_results(again, hill)
    assert len(found.trials) == 18
    assert found.trials[0].values == pytest.approx({"a": 0.1, "b": 0.5})
    assert found.default.figure == pytest.approx((1 - 0.36 + 1 - 0.6) / 2)
    assert abs(found.best.values["a"] - 0.7) < 0.05
    assert found.importance["a"] > found.importance["b"]
    write_report(tmp_path / "r.md", hill, found, None)
    assert "very walls that were tuned on" in (tmp_path / "r.md").read_text().replace("\n", " ")
    write_report(tmp_path / "r.md", hill, found, {"far": (0.5, 0.6)})
    assert "| far | 0.500 | 0.600 |" in (tmp_path / "r.md").read_text()
    write_slices(tmp_path / "s.png", hill, found)
    assert (tmp_path / "s.png").stat().st_size > 2000


@given(
    low=st.floats(-5, 5),
    width=st.floats(0.1, 100),
    share=st.floats(0, 1),
    curve=st.sampled_from([1.0, 2.0, 3.0]),
)
def test_ranges_and_shares_are_inverse(
    low: float, width: float, share: float, curve: float
) -> None:
    r = Range("x", low, low + width, low, curve)
    assert low - 1e-9 <= r.value(share) <= low + width + 1e-9
    assert r.value(r.share(r.value(share))) == pytest.approx(r.value(share), abs=1e-6)
    assert r.value(r.share(low)) == low


def test_another_search_in_the_same_study_is_refused(tmp_path: Path) -> None:
    storage, hill = f"sqlite:///{tmp_path / 's.db'}", Hill()
    open_study(hill, storage, "hill", 0)
    other = Hill()
    other.figure = "depth"
    with pytest.raises(InputError, match="else"):
        open_study(other, storage, "hill", 0)
    with pytest.raises(InputError, match="opened"):
        open_study(hill, f"sqlite:///{tmp_path}/none/s.db", "hill", 0)


def test_a_study_stays_on_its_walls(tmp_path: Path, two_gyms: Path) -> None:
    """Else its first trials would be tuned on the wall that it reports on later."""
    command = ("lift", str(two_gyms), "-o", str(tmp_path / "out"), "--trials", "1")
    assert run_command(*command) == 0
    text = two_gyms.read_text()
    two_gyms.write_text(text.replace("train", "?").replace("test", "train").replace("?", "test"))
    with pytest.raises(InputError, match="else"):
        run_command(*command)


def test_a_password_is_not_printed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\*\*\*") as caught:
        open_study(Hill(), "postgresql+none://me:secret@host/t", "hill", 0)
    assert "secret" not in str(caught.value)


def walls_file(folder: Path, *rows: str) -> Path:
    (folder / "t").mkdir(exist_ok=True)
    (folder / "u").mkdir(exist_ok=True)
    path = folder / "walls.toml"
    path.write_text("\n".join(f"[[wall]]\n{row}" for row in rows))
    return path


def test_walls_are_read(tmp_path: Path) -> None:
    path = walls_file(
        tmp_path, 'name = "a"\nuse = "train"\ntruth = "t"', 'name = "b"\nuse = "test"\ntruth = "u"'
    )
    assert [(w.name, w.use) for w in read_walls(path)] == [("a", "train"), ("b", "test")]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (
            ['name="a"\nuse="train"\ntruth="t"', 'name="a"\nuse="test"\ntruth="u"'],
            "a would be tuned",
        ),
        (
            ['name="a"\nuse="train"\ntruth="t"', 'name="b"\nuse="test"\ntruth="t"'],
            "is the truth of",
        ),
        (['name="a"\nuse="test"\ntruth="t"'], "no wall to tune on"),
        (['name="a"\nuse="both"\ntruth="t"'], "expected train or test"),
        (['name="a"\nuse="train"\ntruth="z"'], "does not exist"),
        (['name="a"\nuse="train"'], "lacks truth"),
        (['name="a"\nuse="train"\ntruth="t"\nmeshes="m"'], "unknown keys"),
        ([], "no .*wall.* tables"),
    ],
)
def test_walls_that_would_mislead_are_refused(
    tmp_path: Path, rows: list[str], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_walls(walls_file(tmp_path, *rows))


def test_settings_file_keeps_other_sections(tmp_path: Path) -> None:
    path = tmp_path / "walltopo.toml"
    path.write_text('[routes]\nmin_holds = 3\nresolution = 1.0\n[detect]\nmodel = "best \\"x\\""\n')
    merge_settings(path, "routes", {"resolution": 2.5})
    merge_settings(path, "lift", {"method": "literal", "threshold": 0.25})
    settings = load_settings(path)
    assert (settings.routes.min_holds, settings.routes.resolution) == (3, 2.5)
    assert (settings.lift.method, settings.lift.threshold) == ("literal", 0.25)
    assert 'best \\"x\\"' in path.read_text()


@pytest.fixture
def two_gyms(tmp_path: Path, make_gym: Callable[[Path], None]) -> Path:
    make_gym(tmp_path / "t")
    make_gym(tmp_path / "u")
    return walls_file(
        tmp_path, 'name="a"\nuse="train"\ntruth="t"', 'name="b"\nuse="test"\ntruth="u"'
    )


def run_command(*words: str) -> int:
    parser = argparse.ArgumentParser()
    commands.register(parser.add_subparsers())
    args = parser.parse_args(["tune", *words])
    return int(args.run(args))


@pytest.mark.parametrize("what", ["lift", "routes"])
def test_tune_command(tmp_path: Path, two_gyms: Path, what: str) -> None:
    out = tmp_path / "out"
    assert run_command(what, str(two_gyms), "-o", str(out), "--trials", "3") == 0
    settings = load_settings(out / "walltopo.toml")
    assert 0 <= settings.lift.threshold <= 1
    report = (out / "report.md").read_text()
    assert "On walls that were not tuned on" in report
    assert "| b |" in report
    assert (out / "slices.png").is_file()
