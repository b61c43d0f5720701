"""Write command results without replacing files that the command did not write.

An existing *file* is replaced with `--overwrite` only. A *folder* gets a marker with the command
that filled it and the hashes of its files. The same command may replace its own unchanged files
there, and removes those that it no longer produces. Other files stay, or need `--overwrite`. Even
with `--overwrite`, these are never replaced: devices, pipes, sockets, links, a folder by a file,
and inputs of the command. `-o LINK` means the target of the link.

Results are written to a temporary folder beside the target. The files are moved after all of them
have been checked, so an error changes nothing.
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

MARKER = ".walltopo-output"  # no .json suffix, because readers of labels open every .json file
_PARTIAL = ".partial-"  # prefix of temporary folders; those of a killed run are ignored


class _Marker(msgspec.Struct, frozen=True):
    """The content of a marker file: the command that filled the folder, and the hash of each file.

    `files` is None for a command that fills the folder over time and resumes from it.
    """

    version: int
    command: str
    files: dict[str, str] | None


def _accept_any(path: Path) -> None:
    """Accept any path."""


@dataclass(frozen=True)
class Target:
    """The path at which a user wants a result.

    Parameters
    ----------
    path : path as given by the user; links are followed.
    flag : command line option of the path, for messages.
    command : command that owns the files, such as "export labelme".
    overwrite : whether other files may be replaced.
    inputs : files and folders that the command reads; never replaced.
    check : raises for paths that are never written, such as the parts of a scan.
    """

    path: Path
    flag: str
    command: str
    overwrite: bool = False
    inputs: Sequence[Path] = ()
    check: Callable[[Path], None] = _accept_any

    @property
    def location(self) -> Path:
        """Return the absolute path with links resolved."""
        return Path(os.path.realpath(self.path))

    def display_path(self, location: Path) -> Path:
        """Return a path within or beside the target as the user would write it."""
        if location.is_relative_to(self.location):
            return self.path / location.relative_to(self.location)
        return self.path.parent / location.name


@contextmanager
def written_file(target: Target) -> Iterator[Path]:
    """Yield a temporary path; move its file, and files beside it, to the target at the end.

    Raises
    ------
    InputError : a file would be replaced; nothing was changed.
    EnvironmentLacksError : the folder cannot be written.
    """
    location = target.location
    _check_file(location, target)
    with scratch_beside(location.parent) as holder:
        yield holder / location.name
        made = sorted(holder.iterdir(), key=lambda path: path.name == location.name)
        for path in made:
            _check_file(location.parent / path.name, target)
        for path in made:
            path.replace(location.parent / path.name)


@contextmanager
def written_folder(target: Target) -> Iterator[Path]:
    """Yield a temporary folder; move its files into the target at the end.

    Raises
    ------
    InputError : the folder belongs to another command, or a foreign file would be replaced; nothing
        was changed.
    EnvironmentLacksError : the folder cannot be written.
    """
    known = _check_folder(target)
    changed = sorted(
        _listed_files(target.location, known) - _unchanged_files(target.location, known)
    )
    if changed and not target.overwrite:
        raise _occupied_error(
            target, target.location / changed[0], "was changed since walltopo wrote it"
        )
    is_new = not target.location.exists()
    try:
        with scratch_beside(target.location) as holder:
            made = holder / target.location.name
            made.mkdir()
            yield made
            _move_results(made, target, known)
    except BaseException:
        if is_new:
            with suppress(OSError):  # not empty: another process wrote a file
                target.location.rmdir()
        raise


def claimed_folder(target: Target) -> Path:
    """Mark and return the folder of a command that fills it over time and resumes.

    Raises
    ------
    InputError : the folder is not empty and belongs to another command; nothing was changed.
    EnvironmentLacksError : the folder cannot be written.
    """
    _check_folder(target)
    try:
        target.location.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentLacksError(f"cannot create {target.path}: {error.strerror}") from error
    _write_marker(target, None)
    return target.path


def _occupied_error(target: Target, location: Path, what: str, allowed: bool = True) -> InputError:
    """Return the error for an occupied path; `allowed`: --overwrite would help."""
    ways = f"Give another {target.flag}" + (", or --overwrite to replace it" if allowed else "")
    return InputError(f"{target.display_path(location)}: {what}", f"{ways}; nothing was changed.")


def _check_file(location: Path, target: Target, own: bool = False) -> None:
    """Raise InputError if this command may not write a path; `own`: the file there is its own."""
    target.check(location)
    if not os.path.lexists(location):
        return
    never = {
        "is a link; it is neither replaced nor followed": location.is_symlink(),
        "is a device, a pipe or a socket; no file can replace it": is_special(location),
        "is a folder, expected a file to write": location.is_dir(),
        "is what this command reads; it cannot replace it": _is_input(location, target),
    }
    for what, found in never.items():
        if found:
            raise _occupied_error(target, location, what, allowed=False)
    if not own and not target.overwrite:
        raise _occupied_error(target, location, "is there already")


def _is_input(location: Path, target: Target) -> bool:
    return any(location.is_relative_to(os.path.realpath(given)) for given in target.inputs)


def _check_folder(target: Target) -> Mapping[str, str]:
    """Return the files that this command wrote there before, with their hashes.

    Raises
    ------
    InputError : the folder is not empty, belongs to another command, and `overwrite` is not set.
    """
    location = target.location
    target.check(location)
    if os.path.lexists(location) and not location.is_dir():
        raise _occupied_error(target, location, "is not a folder", allowed=False)
    if not location.is_dir():
        return {}
    marker = _read_marker(location)
    if marker is not None and marker.command == target.command:
        return marker.files or {}
    if _has_files(location) and not target.overwrite:
        whose = "other files" if marker is None else f"the results of `walltopo {marker.command}`"
        raise InputError(
            f"{target.path}: is not empty: it holds {whose}",
            f"Give another {target.flag}, or --overwrite to write into it (only files of equal "
            "names are replaced); nothing was changed.",
        )
    return {}


def _read_marker(folder: Path) -> _Marker | None:
    """Return the marker of a folder, or None if it is missing or invalid."""
    path = folder / MARKER
    if path.is_symlink() or not path.is_file():
        return None
    try:
        return msgspec.convert(read_json(path), _Marker)
    except (InputError, msgspec.ValidationError):
        return None


def _write_marker(target: Target, files: dict[str, str] | None) -> None:
    marker = _Marker(1, target.command, files)
    write_json(target.location / MARKER, msgspec.to_builtins(marker))


def _has_files(folder: Path) -> bool:
    names = (entry.name for entry in os.scandir(folder))
    return any(name != MARKER and not name.startswith(_PARTIAL) for name in names)


def _own_files(folder: Path) -> set[str]:
    """Return the relative paths of all files below a folder, without marker and temporary ones.

    Links to folders are listed, not followed.
    """
    found = set()
    for root, folders, files in os.walk(folder):
        inside = Path(root).relative_to(folder)
        folders[:] = [name for name in folders if not name.startswith(_PARTIAL)]
        links = [name for name in folders if (Path(root) / name).is_symlink()]
        found |= {str(inside / name) for name in (*files, *links)}
    return found - {MARKER}


def _marker_name(name: str) -> str:
    """Return a file's name as stored in the marker; JSON cannot hold names that are not UTF-8."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


def _listed_files(folder: Path, known: Mapping[str, str]) -> set[str]:
    """Return the files of a folder that its marker lists.

    The marker is untrusted: its names are compared with existing files and never used as paths.
    """
    return {name for name in _own_files(folder) if _marker_name(name) in known} if known else set()


def _unchanged_files(folder: Path, known: Mapping[str, str]) -> set[str]:
    """Return the listed files whose content is still what was written."""
    named = [name for name in _listed_files(folder, known) if not (folder / name).is_symlink()]
    return {name for name in named if hash_path(folder / name) == known[_marker_name(name)]}


def _move_results(made: Path, target: Target, known: Mapping[str, str]) -> None:
    """Move the results into the target, and remove own files that are no longer produced."""
    location = target.location
    own = _unchanged_files(location, known)
    names = sorted(_own_files(made))
    for name in names:
        _check_parents(location / name, target)
        _check_file(location / name, target, own=name in own)
    stale = {name for name in own - set(names) if not _is_input(location / name, target)}
    hashes = {_marker_name(name): hash_path(made / name) for name in names}
    # Write the marker first: after a crash, files without a matching hash count as foreign.
    _write_marker(target, {_marker_name(n): known[_marker_name(n)] for n in own - stale} | hashes)
    for name in names:
        (location / name).parent.mkdir(parents=True, exist_ok=True)
        (made / name).replace(location / name)
    for name in sorted(stale):
        (location / name).unlink()
        _remove_empty((location / name).parent, location)


def _check_parents(location: Path, target: Target) -> None:
    """Raise InputError if a parent folder is a file or a link."""
    for parent in location.parents:
        if parent == target.location:
            return
        if os.path.lexists(parent) and (parent.is_symlink() or not parent.is_dir()):
            raise _occupied_error(target, parent, "is not a folder", allowed=False)


def _remove_empty(folder: Path, top: Path) -> None:
    """Remove empty folders upwards to `top`, which stays."""
    while folder != top:
        try:
            folder.rmdir()
        except OSError:
            return
        folder = folder.parent
