"""Where a command writes what its user asked for: nothing that it did not write is replaced.

A *file* that is there is replaced with `--overwrite` only. A *folder* gets a marker that says
which command filled it, and with what: the same command may replace its own files there, as long
as nobody changed them, and takes away those that it no longer makes. Everything else in it stays,
and what would be replaced wants `--overwrite`. With or without it, no device, pipe, socket or
link is replaced, no folder by a file, and nothing that the command was given to read. `-o LINK`
means what the link leads to.

Results are made in a temporary folder beside the target and moved file by file, when all of them
have been found to have a free place: a refusal changes nothing.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec

from walltopo.core.errors import EnvironmentLacksError, InputError
from walltopo.core.files import hash_path, is_special, read_json, scratch_beside, write_json

MARKER = ".walltopo-output"  # not .json: readers of labels look at every one of those
_PARTIAL = ".partial-"  # what a killed run left behind counts as nothing


class _Marker(msgspec.Struct, frozen=True):
    """What lies in a folder of ours: which command made it, and the hash of each file.

    `files` is None where the command fills the folder over time and resumes from it.
    """

    version: int
    command: str
    files: dict[str, str] | None


def _anywhere(path: Path) -> None:
    """The check of a command that may write wherever nothing is."""


@dataclass(frozen=True)
class Target:
    """Where a user wants a result.

    Parameters
    ----------
    path : as given; its links are followed.
    flag : what it was given with, for messages.
    command : the words that make it, such as "export labelme": whose files its own are.
    overwrite : the user allows that other files are replaced.
    inputs : files and folders that the command reads; never replaced.
    check : raises for places that are never written, such as the parts of a scan.
    """

    path: Path
    flag: str
    command: str
    overwrite: bool = False
    inputs: Sequence[Path] = ()
    check: Callable[[Path], None] = _anywhere

    @property
    def place(self) -> Path:
        """The absolute path, links followed."""
        return Path(os.path.realpath(self.path))

    def shown(self, place: Path) -> Path:
        """A place within or beside the target as the user would write it."""
        if place.is_relative_to(self.place):
            return self.path / place.relative_to(self.place)
        return self.path.parent / place.name


@contextmanager
def written_file(target: Target) -> Iterator[Path]:
    """Give a temporary path; what is made there, and beside it, moves to the target at the end.

    Raises
    ------
    InputError : something is there that would be replaced; nothing was changed.
    EnvironmentLacksError : the folder cannot be written.
    """
    place = target.place
    _check_file(place, target)
    with scratch_beside(place.parent) as holder:
        yield holder / place.name
        made = sorted(holder.iterdir(), key=lambda path: path.name == place.name)
        for path in made:
            _check_file(place.parent / path.name, target)
        for path in made:
            path.replace(place.parent / path.name)


@contextmanager
def written_folder(target: Target) -> Iterator[Path]:
    """Give a temporary folder; its files move into the target at the end.

    Raises
    ------
    InputError : the folder is not of this command, or a file in it would be replaced that is
        not; nothing was changed.
    EnvironmentLacksError : the folder cannot be written.
    """
    known = _judge_folder(target)
    changed = sorted(_named(target.place, known) - _unchanged(target.place, known))
    if changed and not target.overwrite:
        raise _refusal(target, target.place / changed[0], "was changed since walltopo wrote it")
    is_new = not target.place.exists()
    try:
        with scratch_beside(target.place) as holder:
            made = holder / target.place.name
            made.mkdir()
            yield made
            _publish(made, target, known)
    except BaseException:
        if is_new:
            with suppress(OSError):  # not empty: a file of somebody else came meanwhile
                target.place.rmdir()
        raise


def claimed_folder(target: Target) -> Path:
    """The folder of a command that fills it over time and goes on where it stopped; marked.

    Raises
    ------
    InputError : it is not empty and not of this command; nothing was changed.
    EnvironmentLacksError : it cannot be written.
    """
    _judge_folder(target)
    try:
        target.place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentLacksError(f"cannot create {target.path}: {error.strerror}") from error
    _write_marker(target, None)
    return target.path


def _refusal(target: Target, place: Path, what: str, allowed: bool = True) -> InputError:
    """The error for a place that is taken; `allowed`: the user may say --overwrite."""
    ways = f"Give another {target.flag}" + (", or --overwrite to replace it" if allowed else "")
    return InputError(f"{target.shown(place)}: {what}", f"{ways}; nothing was changed.")


def _check_file(place: Path, target: Target, own: bool = False) -> None:
    """Refuse a place that this command may not write; `own`: the file there is its own."""
    target.check(place)
    if not os.path.lexists(place):
        return
    never = {
        "is a link; it is neither replaced nor followed": place.is_symlink(),
        "is a device, a pipe or a socket; no file can replace it": is_special(place),
        "is a folder, expected a file to write": place.is_dir(),
        "is what this command reads; it cannot replace it": _is_input(place, target),
    }
    for what, found in never.items():
        if found:
            raise _refusal(target, place, what, allowed=False)
    if not own and not target.overwrite:
        raise _refusal(target, place, "is there already")


def _is_input(place: Path, target: Target) -> bool:
    return any(place.is_relative_to(os.path.realpath(given)) for given in target.inputs)


def _judge_folder(target: Target) -> Mapping[str, str]:
    """The files that this command wrote there before, with their hashes.

    Raises
    ------
    InputError : the folder is not of this command, not empty, and may not be written into.
    """
    place = target.place
    target.check(place)
    if os.path.lexists(place) and not place.is_dir():
        raise _refusal(target, place, "is no folder", allowed=False)
    if not place.is_dir():
        return {}
    marker = _read_marker(place)
    if marker is not None and marker.command == target.command:
        return marker.files or {}
    if _has_files(place) and not target.overwrite:
        whose = "other files" if marker is None else f"the results of `walltopo {marker.command}`"
        raise InputError(
            f"{target.path}: is not empty: it holds {whose}",
            f"Give another {target.flag}, or --overwrite to write into it (only files of equal "
            "names are replaced); nothing was changed.",
        )
    return {}


def _read_marker(folder: Path) -> _Marker | None:
    """The marker of a folder; None where it has none, or none that can be understood."""
    path = folder / MARKER
    if path.is_symlink() or not path.is_file():
        return None
    try:
        return msgspec.convert(read_json(path), _Marker)
    except (InputError, msgspec.ValidationError):
        return None


def _write_marker(target: Target, files: dict[str, str] | None) -> None:
    marker = _Marker(1, target.command, files)
    write_json(target.place / MARKER, msgspec.to_builtins(marker))


def _has_files(folder: Path) -> bool:
    names = (entry.name for entry in os.scandir(folder))
    return any(name != MARKER and not name.startswith(_PARTIAL) for name in names)


def _files(folder: Path) -> set[str]:
    """Relative paths of what lies in a folder and below, marker and leftovers apart.

    Links to folders are named, not followed.
    """
    found = set()
    for root, folders, files in os.walk(folder):
        inside = Path(root).relative_to(folder)
        folders[:] = [name for name in folders if not name.startswith(_PARTIAL)]
        links = [name for name in folders if (Path(root) / name).is_symlink()]
        found |= {str(inside / name) for name in (*files, *links)}
    return found - {MARKER}


def _key(name: str) -> str:
    """A file's name as the marker has it; JSON cannot hold one that is not UTF-8."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


def _named(folder: Path, known: Mapping[str, str]) -> set[str]:
    """What lies in a folder and is named by its marker.

    The marker's names are compared with what is there and never made into paths: it is a file
    that anyone may have written.
    """
    return {name for name in _files(folder) if _key(name) in known} if known else set()


def _unchanged(folder: Path, known: Mapping[str, str]) -> set[str]:
    """Those of the `known` files that still are what was written."""
    named = [name for name in _named(folder, known) if not (folder / name).is_symlink()]
    return {name for name in named if hash_path(folder / name) == known[_key(name)]}


def _publish(made: Path, target: Target, known: Mapping[str, str]) -> None:
    """Move what was made into the target, and take away what of ours is no longer made."""
    place = target.place
    own = _unchanged(place, known)
    names = sorted(_files(made))
    for name in names:
        _check_parents(place / name, target)
        _check_file(place / name, target, own=name in own)
    stale = {name for name in own - set(names) if not _is_input(place / name, target)}
    hashes = {_key(name): hash_path(made / name) for name in names}
    # Before the files: should this be cut short, what is there counts as somebody else's.
    _write_marker(target, {_key(n): known[_key(n)] for n in own - stale} | hashes)
    for name in names:
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (made / name).replace(place / name)
    for name in sorted(stale):
        (place / name).unlink()
        _remove_empty((place / name).parent, place)


def _check_parents(place: Path, target: Target) -> None:
    """No file, and no link, where a folder has to be."""
    for parent in place.parents:
        if parent == target.place:
            return
        if os.path.lexists(parent) and (parent.is_symlink() or not parent.is_dir()):
            raise _refusal(target, parent, "is no folder", allowed=False)


def _remove_empty(folder: Path, top: Path) -> None:
    """Remove folders that hold nothing any more, up to `top`, which stays."""
    while folder != top:
        try:
            folder.rmdir()
        except OSError:
            return
        folder = folder.parent
