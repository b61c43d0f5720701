"""Caches in memory: artifacts by the stamp of their files, and steps of a replay."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

from walltopo.core.files import file_digest
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.scans.artifacts import Artifact, HasRoot

T = TypeVar("T")


class ArtifactCache:
    """A cache of artifacts; an entry is valid while its file does not change."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[str, Any]] = {}

    def load(self, folder: HasRoot, source: Artifact[T]) -> T:
        """Return the value of an artifact; raises what `Artifact.load` raises."""
        now = file_digest(source.in_folder(folder))
        kept = self._kept.get(source.name)
        if kept is None or kept[0] != now:
            self._kept[source.name] = kept = (now, source.load(folder))
        return cast(T, kept[1])


MAX_ENTRIES = 500
_KNOWN: WeakKeyDictionary[ScanSnapshot, dict[bytes, object]] = WeakKeyDictionary()


def cached(snapshot: ScanSnapshot, key: bytes, make: Callable[[], T]) -> T:
    """Return the cached result of `make`; `key` identifies the function and its inputs."""
    known = _KNOWN.setdefault(snapshot, {})
    if key not in known:
        if len(known) >= MAX_ENTRIES:
            known.clear()
        known[key] = make()
    return cast(T, known[key])
