"""Artifacts of a scan kept in memory, as long as their files are what they were."""

from __future__ import annotations

from typing import Any, TypeVar, cast

from walltopo.core.hashes import stamp
from walltopo.scans.artifacts import Artifact, HasRoot

T = TypeVar("T")


class ArtifactCache:
    """Returns the same object for an artifact while nothing about its file changed."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[str, Any]] = {}

    def load(self, folder: HasRoot, source: Artifact[T]) -> T:
        """Return the value of an artifact; raises what `Artifact.load` raises."""
        now = stamp(source.in_folder(folder))
        kept = self._kept.get(source.name)
        if kept is None or kept[0] != now:
            self._kept[source.name] = kept = (now, source.load(folder))
        return cast(T, kept[1])
