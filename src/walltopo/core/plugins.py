"""Detectors, dense backends and the like: objects that installed distributions register."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar

from walltopo.core.errors import EnvironmentLacksError, InputError

T = TypeVar("T")


@dataclass(frozen=True)
class PluginGroup(Generic[T]):
    """An entry-point group whose members all have one type.

    Parameters
    ----------
    name : the group, such as `walltopo.detectors`.
    kind : the word for a member in messages, such as "detector".
    unknown : the end of "'NAME' is ..." for a name that nobody registered.
    others : what may be given besides a member's name, for the hint.
    """

    name: str
    kind: str
    unknown: str
    others: str

    def names(self) -> tuple[str, ...]:
        """Return the names of all installed members, sorted."""
        return tuple(sorted(self._points()))

    def load(self, name: str) -> T:
        """Import and return the member of a name.

        Raises
        ------
        InputError : nobody registered the name; the hint lists the installed ones.
        EnvironmentLacksError : its distribution is there, but the member cannot be imported.
        """
        point = self._points().get(name)
        if point is None:
            known = ", ".join(self.names()) or "none (install walltopo again)"
            raise InputError(
                f"{name!r} is {self.unknown}", f"Known {self.kind}s: {known}; {self.others}"
            )
        try:
            member: T = point.load()
        except (ImportError, AttributeError) as error:
            package = point.dist.name if point.dist else point.module
            raise EnvironmentLacksError(
                f"the {self.kind} {name!r} of {package} cannot be loaded: {error}",
                f"Install {package} again, with the packages that it needs.",
            ) from error
        return member

    def _points(self) -> dict[str, EntryPoint]:
        return {point.name: point for point in entry_points(group=self.name)}
