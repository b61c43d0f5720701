"""Artifacts: the files and folders of a scan, each with its type, reader and writer.

`ScanFolder` declares all artifacts of a scan. Stages declare their inputs and outputs with them:

    @dataclass(frozen=True)
    class Reads:
        mesh: Mesh = of(ScanFolder.mesh)

A stage may also read other scans, each a bundle of artifacts with a name:

        reference: WholeScan = scan_of(WholeScan, "reference")
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeVar, cast, overload

from walltopo.core import InputError, Progress, Silent
from walltopo.scans.manifest import Metrics, StageRecord

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")


class Stored(Protocol):
    """A value that can read and write itself."""

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the value from a file; raise InputError if the file is damaged."""

    def save(self, path: Path) -> None:
        """Write the value, atomically."""


S = TypeVar("S", bound=Stored)
B = TypeVar("B", bound="DataclassInstance")


class HasRoot(Protocol):
    """A scan folder, reduced to the root that an artifact needs."""

    root: Path


@dataclass(eq=False)
class Artifact(Generic[T]):
    """One file or folder of a scan.

    On a `ScanFolder` object the attribute is the path; on the class it is the artifact.

    Parameters
    ----------
    path : path inside the scan folder.
    made_by : the stage that writes it; "" for a file that a user or another command writes.
    read, write : read a path into a value; write a value to a path, atomically.
    optional : whether None stands for the value if the file is absent.
    fingerprint : hash of the part of the file that counts as a stage's input; None: the whole file.
    """

    path: str
    made_by: str
    read: Callable[[Path], T]
    write: Callable[[Path, T], None]
    optional: bool = False
    fingerprint: Callable[[Path], str] | None = None
    name: str = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, folder: None, owner: type) -> Self: ...
    @overload
    def __get__(self, folder: HasRoot, owner: type) -> Path: ...
    def __get__(self, folder: HasRoot | None, owner: type) -> Self | Path:
        return self if folder is None else self.in_folder(folder)

    def in_folder(self, folder: HasRoot) -> Path:
        """Return the path of the artifact in a scan folder."""
        return folder.root / self.path

    def load(self, folder: HasRoot) -> T:
        """Return the value of the artifact in a scan folder.

        Raises
        ------
        InputError : the file is missing (and not optional) or damaged.
        """
        path = self.in_folder(folder)
        if not path.exists():
            if self.optional:
                return cast(T, None)
            raise InputError(
                f"{path}: the file does not exist",
                f"The stage {self.made_by} writes it: run that stage first.",
            )
        if not (path.is_file() or path.is_dir()):  # reading a pipe would wait for ever
            raise InputError(f"{path}: is a pipe or a device, not a file", "Delete it.")
        return self.read(path)

    def store(self, folder: HasRoot, value: T) -> None:
        """Write the value, atomically; None removes an optional artifact."""
        if value is None:
            self.in_folder(folder).unlink(missing_ok=True)
        else:
            self.write(self.in_folder(folder), value)


def artifact(
    kind: type[S], path: str, made_by: str, fingerprint: Callable[[Path], str] | None = None
) -> Artifact[S]:
    """Return the artifact of a `Stored` type; `fingerprint` as in `Artifact`."""

    def write(file: Path, value: S) -> None:
        value.save(file)

    return Artifact(path, made_by, kind.load, write, fingerprint=fingerprint)


def optional_artifact(kind: type[S], path: str, made_by: str = "") -> Artifact[S | None]:
    """Return the artifact of a `Stored` type whose file may be absent."""

    def write(file: Path, value: S | None) -> None:
        assert value is not None  # `Artifact.store` removes the file instead
        value.save(file)

    return Artifact(path, made_by, kind.load, write, optional=True)


def of(source: Artifact[T]) -> T:
    """Declare a field of a dataclass as the value of an artifact."""
    return cast(T, dataclasses.field(metadata={"artifact": source}))


def scan_of(bundle: type[B], name: str) -> B:
    """Declare a field of a dataclass as artifacts of another scan.

    Parameters
    ----------
    bundle : dataclass whose fields `of` declares; name : which scan, for the stage's caller.
    """
    return cast(B, dataclasses.field(metadata={"bundle": bundle, "scan": name}))


def figures() -> Metrics:
    """Declare the field of a stage's `Writes` for the stage's figures."""
    return cast(Metrics, dataclasses.field())


def artifacts_of(bundle: type[DataclassInstance]) -> Iterator[tuple[str, Artifact[Any]]]:
    """Yield name and artifact of each field that `of` declares."""
    for declared in dataclasses.fields(bundle):
        if "artifact" in declared.metadata:
            yield declared.name, declared.metadata["artifact"]


def scans_of(bundle: type[DataclassInstance]) -> Iterator[tuple[str, str, type[Any]]]:
    """Yield field name, scan name and bundle of each field that `scan_of` declares."""
    for declared in dataclasses.fields(bundle):
        if "scan" in declared.metadata:
            yield declared.name, declared.metadata["scan"], declared.metadata["bundle"]


Load = Callable[[Any, Artifact[Any]], Any]


def load_artifact(folder: HasRoot, source: Artifact[T]) -> T:
    """Return the value of an artifact; the default for functions that take a `Load`."""
    return source.load(folder)


def load_bundle(
    folder: HasRoot,
    bundle: type[B],
    load: Load = load_artifact,
    others: Mapping[str, HasRoot] = MappingProxyType({}),
) -> B:
    """Return a dataclass whose fields are the values of their artifacts.

    Parameters
    ----------
    others : the scans that `scan_of` names.

    Raises
    ------
    InputError : an artifact is missing (and not optional) or damaged.
    """
    values = {name: load(folder, source) for name, source in artifacts_of(bundle)}
    for name, scan, inner in scans_of(bundle):
        values[name] = load_bundle(others[scan], inner, load)
    return bundle(**values)


@dataclass(frozen=True)
class Context:
    """The folders, progress and records of a stage's run.

    Parameters
    ----------
    scratch : an empty folder on the scan's disk, deleted after the stage. Outputs are created
        here and moved into place.
    cache : the scan's `work/`, which may be deleted at any time and only saves time.
    progress : receives the steps.
    title : the scan's name, for people.
    records : records of the stages' last runs, by name; for reports, never for results.
    """

    scratch: Path
    cache: Path
    progress: Progress = field(default_factory=Silent)
    title: str = ""
    records: Mapping[str, StageRecord] = field(default_factory=dict)
