"""What was worked out of a scan before: a log is replayed at every step that a setter takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast
from weakref import WeakKeyDictionary

from walltopo.editing.snapshot import ScanSnapshot

T = TypeVar("T")
MOST = 500
_KNOWN: WeakKeyDictionary[ScanSnapshot, dict[bytes, object]] = WeakKeyDictionary()


def remembered(scanned: ScanSnapshot, key: bytes, make: Callable[[], T]) -> T:
    """What `make` gives, or gave under the same key; the key names what is made, and of what."""
    known = _KNOWN.setdefault(scanned, {})
    if key not in known:
        if len(known) >= MOST:
            known.clear()
        known[key] = make()
    return cast(T, known[key])
