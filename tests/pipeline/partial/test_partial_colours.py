"""A partial rescan of the holds of one colour."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs
from tests.pipeline.partial.partial_walls import STEP, Wall, photos_at

from walltopo.cli import main
from walltopo.core import Mesh, SettingsError
from walltopo.pipeline.partial.colours import ColourChoice, check_colours, colours_of
from walltopo.pipeline.partial.region import Region, replaced_region
from walltopo.pipeline.partial.rows import JoinedTables, Tables, join_tables
from walltopo.pipeline.settings import load_settings
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Route, Routes

VIEWS = photos_at((0.4, 0.9), (0.7, 1.1), (0.9, 1.0))
# Hold id to its centre (x, z) and half its side, and to its colour.
OLD = Wall(
    holds={
        1: (0.5, 1.2, 0.05),  # still there
        2: (0.9, 1.0, 0.05),  # still there
        3: (0.5, 0.7, 0.05),  # removed
        4: (0.2, 1.0, 0.05),  # removed
        5: (3.2, 1.0, 0.05),  # not photographed
        6: (1.1, 0.7, 0.06),  # still there
        7: (3.5, 1.0, 0.06),  # not photographed
    }
)
OLD_COLOURS = {1: "red", 2: "blue", 3: "blue", 4: "red", 5: "blue", 6: "red", 7: "red"}
NEW = Wall(
    x=(0.0, 2.2),
    holds={
        1: (0.5, 1.2, 0.05),
        2: (0.9, 1.0, 0.05),
        3: (0.8, 1.35, 0.06),
        4: (0.3, 1.35, 0.06),
        5: (1.1, 0.7, 0.06),
    },
)
# Hold 1 is red in other light, hold 5 in the same.
NEW_COLOURS = {1: "orange", 2: "red", 3: "red", 4: "green", 5: "red"}


def _table(wall: Wall, colours: dict[int, str]) -> Holds:
    rows = [structs.replace(row, colour=colours[row.id]) for row in wall.rows()]
    return Holds(metric=True, holds=tuple(rows))


@dataclass(frozen=True, eq=False)
class Reset:
    """A joined wall, and what it was joined of."""

    meshes: tuple[Mesh, Mesh]
    labels: tuple[np.ndarray, np.ndarray]
    holds: tuple[Holds, Holds]
    choice: ColourChoice
    region: Region
    tables: JoinedTables


def _reset(*colours: str, new: Wall = NEW, new_colours: dict[int, str] = NEW_COLOURS) -> Reset:
    (old_mesh, old_labels), (new_mesh, new_labels) = OLD.mesh(), new.mesh(0.001)
    before, after = _table(OLD, OLD_COLOURS), _table(new, new_colours)
    choice = ColourChoice.of(colours, before, before, after)
    region = replaced_region(
        old_mesh, old_labels, new_mesh, new_labels, VIEWS, exchange=choice.exchange
    )
    routes = (Route(id=1, colour="blue", holds=(2, 3, 5)), Route(id=2, colour="red", holds=(1, 4)))
    old = Tables(
        frozenset(old_labels[region.old].tolist()) - {0}, before, Routes(routes=routes), (), 7
    )
    fresh = Tables(
        frozenset(region.new_labels[region.new].tolist()) - {0}, after, Routes(routes=()), (), 5
    )
    tables = join_tables(old, fresh, {"a.jpg": "a.jpg"}, {"a.jpg"})
    return Reset(
        (old_mesh, new_mesh), (old_labels, new_labels), (before, after), choice, region, tables
    )


def test_only_holds_of_the_colour_are_exchanged() -> None:
    reset = _reset("red")
    tables, before = reset.tables, {hold.id: hold for hold in reset.holds[0].holds}
    # The new red hold is added; the green one is not, nor is the blue one exchanged.
    assert {hold.id: hold.colour for hold in tables.holds.holds} == {
        1: "orange",
        2: "blue",
        3: "blue",
        5: "blue",
        6: "red",
        7: "red",
        8: "red",
    }
    assert tables.same == {1, 6}
    assert tables.gone == {4}
    assert tables.added == {8}
    kept = {hold.id: hold for hold in tables.holds.holds}
    assert all(kept[number] == before[number] for number in (2, 3, 5, 7))
    (blue,) = [route for route in tables.routes.routes if route.id == 1]
    assert blue.holds == (2, 3, 5)
    assert blue.colour == "blue"


def test_holds_of_other_colours_keep_their_triangles() -> None:
    reset = _reset("red")
    region, old_labels = reset.region, reset.labels[0]
    for number in (2, 3, 5):
        assert region.old[old_labels == number].all()
    for number in (1, 4, 6):
        assert not region.old[old_labels == number].any()
    assert set(region.new_labels.tolist()) == {0, 1, 3, 5}
    # The surface around them is new, and reaches only a little over them.
    old, new = reset.meshes
    around = np.abs(old.centroids[:, [0, 2]] - [0.9, 1.0]).max(axis=1) < 0.2
    assert not region.old[around & (old_labels == 0)].any()
    over = (np.abs(new.centroids[:, [0, 2]] - [0.9, 1.0]) < 0.05 - STEP).all(axis=1)
    assert not region.new[over].any()
    kept = np.vstack([old.centroids[region.old], new.centroids[region.new]])[:, [0, 2]]
    away = np.linalg.norm(old.centroids[around][:, None, [0, 2]] - kept[None], axis=2).min(axis=1)
    assert away.max() < STEP


def test_what_contradicts_the_colour_is_counted() -> None:
    reset = _reset("red")
    assert reset.choice.missing(reset.region, reset.holds[0]) == [3]
    assert reset.choice.ignored(reset.region, reset.holds[1]) == 1


def test_a_hold_over_one_of_another_colour_is_added_and_the_other_one_reported() -> None:
    """A large red hold covers the place of a small blue one."""
    reset = _reset("red", new=replace(NEW, holds={**NEW.holds, 2: (0.93, 1.03, 0.14)}))
    assert 2 in reset.region.new_labels
    assert {hold.id: hold.colour for hold in reset.tables.holds.holds}[2] == "blue"
    assert reset.choice.missing(reset.region, reset.holds[0]) == [2, 3]


def test_a_corrected_colour_counts() -> None:
    before, after = _table(OLD, OLD_COLOURS), _table(NEW, NEW_COLOURS)
    shown = _table(OLD, {**OLD_COLOURS, 3: "red"})
    choice = ColourChoice.of(("red",), before, shown, after)
    assert choice.exchange is not None
    assert 3 in choice.exchange.old


def test_all_colours_exchange_as_before() -> None:
    reset = _reset()
    assert reset.choice == ColourChoice()
    assert reset.tables.gone == {3, 4}
    assert len(reset.tables.added) == 2
    assert reset.region.held == frozenset()
    reset = _reset("red", "blue", "green", "orange")
    assert reset.tables.gone == {3, 4}
    assert len(reset.tables.added) == 2
    assert reset.choice.missing(reset.region, reset.holds[0]) == []
    assert reset.choice.ignored(reset.region, reset.holds[1]) == 0


def test_the_setting_names_colours() -> None:
    assert colours_of("") == ()
    assert colours_of("red, sky blue,") == ("red", "sky blue")
    with pytest.raises(SettingsError, match=r"needs sparse\.part"):
        SparseSettings(reference="wall", part_colours="red")


def test_an_unknown_colour_is_refused_before_the_scan(tmp_path: Path) -> None:
    folder = ScanFolder(tmp_path)
    _table(OLD, dict.fromkeys(OLD_COLOURS, "Hausrot")).save(folder.holds)
    words = [f"sparse.reference={str(tmp_path)!r}", "sparse.part=true"]
    for known in ("red", "Hausrot", "red,Hausrot"):
        check_colours(load_settings(None, [*words, f"sparse.part_colours={known!r}"]))
    with pytest.raises(SettingsError, match="Hausblau") as refused:
        check_colours(load_settings(None, [*words, "sparse.part_colours='Hausblau'"]))
    assert "Hausrot" in refused.value.hint
    palette = tmp_path / "palette.toml"
    palette.write_text('[[colour]]\nname = "Hausblau"\nrgb = [0, 0, 200]\n')
    words.append(f"classify.palette={str(palette)!r}")
    check_colours(load_settings(None, [*words, "sparse.part_colours='Hausblau'"]))
    with pytest.raises(SettingsError, match="red"):
        check_colours(load_settings(None, [*words, "sparse.part_colours='red'"]))


def test_the_option_names_colours(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = ScanFolder(tmp_path / "wall"), tmp_path / "wall2"
    folder.root.mkdir()
    _table(OLD, OLD_COLOURS).save(folder.holds)
    words = ["scan", str(tmp_path), "-o", str(out), "--reference", str(folder.root)]
    assert main([*words, "--part", "--colour", "red", "--colour", "mauve"]) == 2
    assert "no colour is named mauve" in capsys.readouterr().err
    assert main([*words, "--colour", "red"]) == 2
    assert "needs sparse.part" in capsys.readouterr().err
    assert not ScanFolder(out).manifest.exists()
