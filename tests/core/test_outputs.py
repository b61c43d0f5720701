"""Results never replace what their command did not write."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.core.files import atomic_path
from walltopo.core.outputs import MARKER, Target, claimed_folder, written_file, written_folder


def _target(path: Path, *, overwrite: bool = False, inputs: tuple[Path, ...] = ()) -> Target:
    return Target(path, "-o", "paint walls", overwrite, inputs)


def _write(target: Target, **files: str) -> None:
    """Fill a folder target; `a__b="x"` is the file a/b."""
    with written_folder(target) as made:
        for name, text in files.items():
            path = made / name.replace("__", "/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)


def _content(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != MARKER
    }


@contextmanager
def _refused(what: str) -> Iterator[None]:
    with pytest.raises(InputError, match=what) as caught:
        yield
    assert "-o" in caught.value.hint


def test_a_new_file_and_what_comes_with_it(tmp_path: Path) -> None:
    with written_file(_target(tmp_path / "deep" / "wall.obj")) as path:
        path.write_text("mesh")
        path.with_suffix(".mtl").write_text("look")
    assert _content(tmp_path) == {"deep/wall.obj": "mesh", "deep/wall.mtl": "look"}


def test_a_file_wants_overwrite(tmp_path: Path) -> None:
    path = tmp_path / "wall.obj"
    path.write_text("mine")
    with _refused("is there already"), written_file(_target(path)):
        pytest.fail("asked before the work, not after it")
    with written_file(_target(path, overwrite=True)) as made:
        made.write_text("new")
    assert _content(tmp_path) == {"wall.obj": "new"}


def test_what_comes_with_a_file_wants_overwrite_too(tmp_path: Path) -> None:
    (tmp_path / "wall.mtl").write_text("mine")
    with (
        _refused(r"wall\.mtl: is there already"),
        written_file(_target(tmp_path / "wall.obj")) as p,
    ):
        p.write_text("mesh")
        p.with_suffix(".mtl").write_text("look")
    assert _content(tmp_path) == {"wall.mtl": "mine"}


@pytest.mark.parametrize("overwrite", [False, True])
def test_only_files_are_replaced_by_files(tmp_path: Path, overwrite: bool) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name, output in (("pipe", "a pipe"), ("folder", "is a folder")):
        target = _target(tmp_path / name, overwrite=overwrite)
        with _refused(output), written_file(target):
            pytest.fail("asked before the work, not after it")
    with _refused("is a device"), written_file(_target(Path("/dev/null"), overwrite=overwrite)):
        pytest.fail("asked before the work, not after it")
    assert Path("/dev/null").is_char_device()


def test_a_link_means_what_it_leads_to(tmp_path: Path) -> None:
    (tmp_path / "real.txt").write_text("old")
    link = tmp_path / "link.txt"
    link.symlink_to("real.txt")
    with _refused("is there already"), written_file(_target(link)):
        pytest.fail("asked before the work, not after it")
    with written_file(_target(link, overwrite=True)) as made:
        made.write_text("new")
    assert link.is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_an_input_is_never_replaced(tmp_path: Path) -> None:
    photo = tmp_path / "photo.jpg"
    photo.write_text("light")
    target = _target(photo, overwrite=True, inputs=(tmp_path / "." / "photo.jpg",))
    with _refused("what this command reads"), written_file(target):
        pytest.fail("asked before the work, not after it")


def test_a_folder_is_filled_and_filled_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    _write(_target(out), a="1", deep__b="2", deep__c="3")
    (out / "mine.txt").write_text("notes")
    _write(_target(out), a="10", d="4")
    assert _content(out) == {"a": "10", "d": "4", "mine.txt": "notes"}
    assert not (out / "deep").exists()


@pytest.mark.parametrize("marker", ["", "not json", '{"version": 1, "command": "other"}', "[[[["])
def test_a_folder_of_somebody_else_wants_overwrite(tmp_path: Path, marker: str) -> None:
    (tmp_path / "a").write_text("mine")
    (tmp_path / "other").write_text("mine")
    if marker:
        (tmp_path / MARKER).write_text(marker)
    with _refused("not empty"):
        _write(_target(tmp_path), a="1")
    with _refused("not empty"):
        claimed_folder(_target(tmp_path))
    assert _content(tmp_path) == {"a": "mine", "other": "mine"}
    _write(_target(tmp_path, overwrite=True), a="1")
    assert _content(tmp_path) == {"a": "1", "other": "mine"}


def test_the_results_of_another_command_are_somebody_elses(tmp_path: Path) -> None:
    _write(Target(tmp_path / "out", "-o", "merge"), a="1")
    with _refused("the results of `walltopo merge`"):
        _write(_target(tmp_path / "out"), a="2")


def test_what_a_user_corrected_stays(tmp_path: Path) -> None:
    out = tmp_path / "out"
    _write(_target(out), a="1", b="2")
    (out / "b").write_text("corrected by hand")
    with _refused(r"b: was changed since"), written_folder(_target(out)):
        pytest.fail("asked before the work, not after it")
    _write(_target(out, overwrite=True), a="3")
    assert _content(out) == {"a": "3", "b": "corrected by hand"}


def test_a_file_that_came_while_the_command_ran_stays(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with _refused("is there already"), written_folder(_target(out)) as made:
        (made / "a").write_text("1")
        (out / "a").write_text("mine")
    assert _content(out) == {"a": "mine"}


def test_inputs_in_a_folder_of_ours_stay(tmp_path: Path) -> None:
    out = tmp_path / "out"
    _write(_target(out), mesh="1", refined__mesh="2")
    inputs = (out / "refined" / "mesh",)
    _write(_target(out, inputs=inputs), mesh="3")
    assert _content(out) == {"mesh": "3", "refined/mesh": "2"}
    with _refused("what this command reads"):
        _write(_target(out, inputs=inputs, overwrite=True), refined__mesh="4")


def test_links_in_a_folder_are_not_followed(tmp_path: Path) -> None:
    out, precious = tmp_path / "out", tmp_path / "precious"
    precious.mkdir()
    (precious / "a").write_text("mine")
    _write(_target(out), page__a="1")
    (out / "page" / "a").unlink()
    (out / "page").rmdir()
    (out / "page").symlink_to(precious)
    with _refused("page: is not a folder"):
        _write(_target(out, overwrite=True), page__a="2")
    assert (precious / "a").read_text() == "mine"


def test_a_marker_leads_nowhere(tmp_path: Path) -> None:
    """A marker is a file that anyone may write: what it names elsewhere is not touched."""
    (tmp_path / "victim").write_text("mine")
    out = tmp_path / "out"
    _write(_target(out), a="1")
    text = (out / MARKER).read_text()
    (out / MARKER).write_text(text.replace('"a"', '"../victim"'))
    _write(_target(out), b="2")
    assert (tmp_path / "victim").read_text() == "mine"
    assert _content(out) == {"a": "1", "b": "2"}


def _fail(target: Target) -> None:
    with written_folder(target) as made:
        (made / "a").write_text("1")
        raise ValueError("no")


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no"):
        _fail(_target(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == []


def test_a_command_that_resumes_claims_its_folder(tmp_path: Path) -> None:
    out = claimed_folder(_target(tmp_path / "run"))
    (out / "state").write_text("half")
    claimed_folder(_target(tmp_path / "run"))
    with _refused("the results of `walltopo paint walls`"):
        claimed_folder(Target(out, "-o", "train"))
    assert _content(out) == {"state": "half"}


def test_names_that_are_not_utf8(tmp_path: Path) -> None:
    name = os.fsdecode(b"gr\xf6\xdfe.txt")
    for text in ("1", "2"):
        with written_folder(_target(tmp_path / "out")) as made:
            (made / name).write_text(text)
    assert (tmp_path / "out" / name).read_text() == "2"


names = st.sampled_from(["a", "b", "c/d", "c/e"])
files = st.dictionaries(names, st.sampled_from(["1", "2"]))


@settings(max_examples=60)
@given(first=files, user=files, second=files)
def test_no_byte_of_a_user_is_lost(
    tmp_path_factory: pytest.TempPathFactory,
    first: dict[str, str],
    user: dict[str, str],
    second: dict[str, str],
) -> None:
    out = tmp_path_factory.mktemp("any") / "out"
    _write(_target(out), **{name.replace("/", "__"): text for name, text in first.items()})
    mine = {name: f"mine {text}" for name, text in user.items()}
    for name, text in mine.items():
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_text(text)
    before = _content(out)
    try:
        _write(_target(out), **{name.replace("/", "__"): text for name, text in second.items()})
    except InputError:
        assert _content(out) == before
        return
    assert {name: text for name, text in _content(out).items() if name in mine} == mine
    assert _content(out) == second | mine


def test_an_atomic_write_replaces_no_pipe_and_no_folder(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="a pipe"), atomic_path(tmp_path / "pipe") as path:
        path.write_text("x")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="is a folder"), atomic_path(tmp_path / "folder") as path:
        path.write_text("x")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="is a file"), atomic_path(tmp_path / "file") as path:
        path.mkdir()
    assert (tmp_path / "pipe").is_fifo()
    assert (tmp_path / "file").read_text() == "mine"
    assert not list(tmp_path.glob(".partial-*"))
