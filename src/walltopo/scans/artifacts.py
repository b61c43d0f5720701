"""An artifact: one file or folder of a scan, with its type and how it is read and written.

`ScanFolder` declares all artifacts of a scan. Stages name what they read and write by them:

    @dataclass(frozen=True)
    class Reads:
        mesh: Mesh = of(ScanFolder.mesh)
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, Self, TypeVar, cast, overload

from walltopo.core import InputError
from walltopo.scans.manifest import Metrics

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")


class Stored(Protocol):
    """A value that knows how it lies on disk."""

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read the value; InputError where the file is damaged."""

    def save(self, path: Path) -> None:
        """Write the value, atomically."""


S = TypeVar("S", bound=Stored)


class HasRoot(Protocol):
    """A scan folder, as far as an artifact needs it."""

    root: Path


@dataclass(eq=False)
class Artifact(Generic[T]):
    """One file or folder of a scan.

    On a `ScanFolder` object the attribute is the path; on the class it is the artifact.

    Parameters
    ----------
    path : place inside the scan folder.
    made_by : the stage that makes it; "" for a file that a user or another command writes.
    read, write : read a path into a value; write a value to a path, atomically.
    optional : None stands for the value where the file is absent.
    fingerprint : hash of what of the file counts as input of a stage; None: all of it.
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
                f"{path}: no such file", f"The stage {self.made_by} makes it: run it first."
            )
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
    """Return the artifact of a type that loads and saves itself; `fingerprint` as in `Artifact`."""

    def write(file: Path, value: S) -> None:
        value.save(file)

    return Artifact(path, made_by, kind.load, write, fingerprint=fingerprint)


def optional_artifact(kind: type[S], path: str, made_by: str = "") -> Artifact[S | None]:
    """Return the same for a file that may be absent."""

    def write(file: Path, value: S | None) -> None:
        assert value is not None  # `Artifact.store` removes the file instead
        value.save(file)

    return Artifact(path, made_by, kind.load, write, optional=True)


def of(source: Artifact[T]) -> T:
    """Declare that a field of a dataclass holds the value of an artifact."""
    return cast(T, dataclasses.field(metadata={"artifact": source}))


def figures() -> Metrics:
    """Declare the field of a stage's `Writes` that holds the stage's figures."""
    return cast(Metrics, dataclasses.field())


def artifacts_of(bundle: type[DataclassInstance]) -> Iterator[tuple[str, Artifact[Any]]]:
    """Yield name and artifact of each field that `of` declares."""
    for field in dataclasses.fields(bundle):
        if "artifact" in field.metadata:
            yield field.name, field.metadata["artifact"]


Load = Callable[[Any, Artifact[Any]], Any]
B = TypeVar("B", bound="DataclassInstance")


def load_artifact(folder: HasRoot, source: Artifact[T]) -> T:
    """Return the value of an artifact; the default of functions that take a `Load`."""
    return source.load(folder)


def load_bundle(folder: HasRoot, bundle: type[B], load: Load = load_artifact) -> B:
    """Return a dataclass whose fields are the values of their artifacts.

    Raises
    ------
    InputError : one of them is missing (and not optional) or damaged.
    """
    return bundle(**{name: load(folder, source) for name, source in artifacts_of(bundle)})
