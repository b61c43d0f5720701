"""Names from data stay in their folder; TOML is read or refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.core.files import deeper_than, join_inside, read_toml


@pytest.mark.parametrize("name", ["a.jpg", "cam1/a.jpg", "ä b.jpg", "...jpg", "a..b/c", "./a.jpg"])
def test_names_within_a_folder_are_joined(tmp_path: Path, name: str) -> None:
    assert join_inside(tmp_path, name) == tmp_path / name


@pytest.mark.parametrize(
    "name",
    [
        "",
        ".",
        "..",
        "../a.jpg",
        "a/../../b.jpg",
        "/etc/passwd",
        "\\\\host\\a.jpg",
        "C:\\a.jpg",
        "C:a.jpg",
        "..\\a.jpg",
        "a\x00.jpg",
        "a\n.jpg",
        "\x1b[31m.jpg",
        "\ud800.jpg",
        "a" * 256,
    ],
)
def test_names_that_lead_out_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="name"):
        join_inside(tmp_path, name)


@given(st.text(alphabet=st.sampled_from("a./\\:.")))
def test_no_name_leads_out(name: str) -> None:
    root = Path("/somewhere/root")
    try:
        path = join_inside(root, name)
    except InputError:
        return
    assert path.resolve().is_relative_to(root)


def test_a_linked_folder_that_leads_out_is_refused_and_a_linked_file_is_not(tmp_path: Path) -> None:
    (tmp_path / "root").mkdir()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "a.jpg").write_text("picture")
    (tmp_path / "root" / "out").symlink_to(tmp_path / "other")
    (tmp_path / "root" / "a.jpg").symlink_to(tmp_path / "other" / "a.jpg")
    assert join_inside(tmp_path / "root", "a.jpg").read_text() == "picture"
    with pytest.raises(InputError, match="link"):
        join_inside(tmp_path / "root", "out/a.jpg")


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "9" * 5000,
        "a = " + "[" * 50 + "]" * 50,
        ".".join("a" * 200) + " = 1",
        "a = " + '"' + "x" * (5 << 20) + '"',
        "[",
        b"\xff".decode("latin-1"),
    ],
    ids=["deep", "digits", "fifty deep", "dotted", "five megabytes", "cut", "latin-1"],
)
def test_toml_that_no_one_writes_names_the_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "t.toml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"t\.toml"):
        read_toml(path)
    with pytest.raises(InputError, match="no such file"):
        read_toml(tmp_path / "other.toml")
    with pytest.raises(InputError, match="read"):
        read_toml(tmp_path)


def test_depth_is_counted() -> None:
    assert not deeper_than(2, {"a": [1]})
    assert deeper_than(1, {"a": [1]})
    assert not deeper_than(0, "text")
