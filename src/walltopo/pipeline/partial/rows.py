"""Join the tables of a wall and of a partial rescan: instances, holds, routes and edits.

Numbers are stable: what stays keeps its id; a new instance that is an old hold (same place, size
and direction) takes over the old id, so that routes, edits and climbers' ticks stay with it; all
others get ids that the wall never used.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.matching.holds import match_holds
from walltopo.describe.routes.find import describe_route
from walltopo.describe.routes.start_and_top import wall_stats
from walltopo.scans.edits import Add, Cut, Edit, EditLog, Paint, Place, Ref
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.instances import InstanceRecord
from walltopo.scans.routes import Route, Routes

Labels = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Tables:
    """The tables of one scan before any edit, reduced to what stays or is added.

    Parameters
    ----------
    present : ids of the instances whose triangles are in the joined wall.
    holds, left_out, routes, records : all rows of the scan.
    last_id : the highest id that the scan or its edits ever used.
    """

    present: frozenset[int]
    holds: Holds
    routes: Routes
    records: tuple[InstanceRecord, ...]
    last_id: int


@dataclass(frozen=True, eq=False)
class JoinedTables:
    """The tables of the joined wall.

    Parameters
    ----------
    number_of : id in the new scan to id in the joined wall.
    same : old holds that were photographed and are unchanged; gone : ids of old holds that are
        no more there; added : ids of new holds.
    """

    holds: Holds
    routes: Routes
    records: tuple[InstanceRecord, ...]
    number_of: Mapping[int, int]
    same: frozenset[int]
    gone: frozenset[int]
    added: frozenset[int]


def join_tables(
    old: Tables, new: Tables, photo_of: Mapping[str, str], kept_photos: Collection[str]
) -> JoinedTables:
    """Return the tables of the joined wall.

    Parameters
    ----------
    photo_of : name of each new photo in the joined wall.
    kept_photos : names of the old photos that stay.
    """
    stays = [hold for hold in old.holds.holds if hold.id in old.present]
    photographed = [hold for hold in old.holds.holds if hold.id not in old.present]
    arrived = [hold for hold in new.holds.holds if hold.id in new.present]
    same = match_holds(photographed, arrived, old.holds.unit)
    number_of = _joined_ids(new.present, {b: a for a, b in same.items()}, old.last_id)
    arrived = [_moved(hold, number_of, photo_of) for hold in arrived]
    stays = [_with_photos(hold, kept_photos) for hold in stays]
    holds = sorted([*stays, *arrived], key=lambda hold: hold.id)
    left_out = [
        _with_photos(hold, kept_photos) for hold in old.holds.left_out if hold.id in old.present
    ]
    left_out += [
        _moved(hold, number_of, photo_of) for hold in new.holds.left_out if hold.id in new.present
    ]
    joined = replace(
        old.holds,
        holds=tuple(holds),
        left_out=tuple(sorted(left_out, key=lambda hold: (-hold.score, hold.id))),
    )
    gone = frozenset(hold.id for hold in photographed) - same.keys()
    added = frozenset(hold.id for hold in arrived) - same.keys()
    return JoinedTables(
        holds=joined,
        routes=_join_routes(old.routes, new.routes, joined, number_of, added),
        records=_join_records(old, new, number_of, photo_of),
        number_of=number_of,
        same=frozenset(same),
        gone=gone,
        added=added,
    )


def _joined_ids(ids: Iterable[int], same: Mapping[int, int], last: int) -> dict[int, int]:
    """Return the joined id of each new id: the old hold's, else one above `last`."""
    found: dict[int, int] = {}
    for number in sorted(ids):
        if number in same:
            found[number] = same[number]
        else:
            last += 1
            found[number] = last
    return found


def _moved(hold: Hold, number_of: Mapping[int, int], photo_of: Mapping[str, str]) -> Hold:
    photos = tuple(photo_of[name] for name in hold.photos if name in photo_of)
    return replace(hold, id=number_of[hold.id], photos=photos, route=None)


def _with_photos(hold: Hold, kept: Collection[str]) -> Hold:
    return replace(hold, photos=tuple(name for name in hold.photos if name in kept))


def _join_records(
    old: Tables, new: Tables, number_of: Mapping[int, int], photo_of: Mapping[str, str]
) -> tuple[InstanceRecord, ...]:
    rows = [row for row in old.records if row.id in old.present]
    for row in new.records:
        if row.id in new.present:
            views = tuple((photo_of[name], mask) for name, mask in row.views if name in photo_of)
            rows.append(replace(row, id=number_of[row.id], views=views))
    return tuple(sorted(rows, key=lambda row: row.id))


def _join_routes(
    old: Routes, new: Routes, holds: Holds, number_of: Mapping[int, int], added: Collection[int]
) -> Routes:
    """Return the routes: the old ones without what is gone, and those of new holds.

    New holds join the old route with which their own route shares most unchanged holds.
    """
    known = {hold.id: hold for hold in holds.holds}
    members = {route.id: [h for h in route.holds if h in known] for route in old.routes}
    owner = {hold: route for route, found in members.items() for hold in found}
    number = max(members, default=0)
    for route in new.routes:
        own = [number_of[hold] for hold in route.holds if hold in number_of]
        fresh = [hold for hold in own if hold in added]
        votes = [owner[hold] for hold in own if hold in owner]
        if not fresh:
            continue
        if votes:
            members[max(sorted(set(votes)), key=votes.count)] += fresh
        else:
            number += 1
            members[number] = fresh
    rows = {route.id: route for route in old.routes}
    alive = {route: [known[hold] for hold in found] for route, found in members.items() if found}
    wall = wall_stats(list(alive.values()), holds.holds)
    in_routes = {hold.id for found in alive.values() for hold in found}
    unrouted = [h for h in holds.holds if h.role == "hold" and h.id not in in_routes]
    wall = wall.with_strays(unrouted, holds.left_out)
    described = [
        _kept_row(rows[route], known.keys(), alive.keys())
        if route in rows and {hold.id for hold in found} == set(rows[route].holds)
        else describe_route(route, found, wall)
        for route, found in alive.items()
    ]
    volumes = sorted(hold.id for hold in holds.holds if hold.role == "volume")
    return Routes(
        routes=tuple(described),
        unrouted=tuple(sorted(hold.id for hold in unrouted)),
        volumes=tuple(volumes),
    )


def _kept_row(route: Route, holds: Collection[int], routes: Collection[int]) -> Route:
    """Return the row of a route with the same holds, without references to what is gone."""
    ambiguous = [
        row
        for row in route.ambiguous
        if row.hold in holds and all(int(number) in routes for number in row.routes)
    ]
    return replace(route, ambiguous=tuple(ambiguous))


def carried_edits(
    log: EditLog, gone: Collection[int], is_replaced: Callable[[Place], bool]
) -> EditLog:
    """Return the entries of a log that still apply, their references reduced to ids.

    A place would lead an entry to the new hold in a gone hold's place. Entries on gone holds, and
    shapes drawn on replaced surface, are left out.

    Parameters
    ----------
    gone : ids of holds that are no more there; is_replaced : whether a place was replaced.
    """
    carried = (_carried(edit, gone, is_replaced) for edit in log.edits)
    return EditLog(edits=tuple(edit for edit in carried if edit is not None))


def _carried(
    edit: Edit, gone: Collection[int], is_replaced: Callable[[Place], bool]
) -> Edit | None:
    if isinstance(edit, Add):
        return None if edit.hold.at is not None and is_replaced(edit.hold.at) else edit
    if isinstance(edit, Paint) and is_replaced(edit.at):
        return None
    if isinstance(edit, Cut) and any(map(is_replaced, edit.points)):
        return None
    changed: dict[str, object] = {}
    for name in edit.__struct_fields__:
        value = getattr(edit, name)
        is_route = name in ("route", "routes")
        if isinstance(value, Ref):
            if value.id in gone and not is_route:
                return None
            changed[name] = Ref(value.id)
        elif _are_refs(value):
            left = tuple(Ref(ref.id) for ref in value if is_route or ref.id not in gone)
            if value and not left:
                return None
            changed[name] = left
    # Check the limits of the type, such as a least number of references.
    try:
        return msgspec.convert(msgspec.to_builtins(replace(edit, **changed)), type(edit))
    except msgspec.ValidationError:
        return None


def _are_refs(value: object) -> bool:
    return isinstance(value, tuple) and len(value) > 0 and isinstance(value[0], Ref)


def renumbered(labels: Labels, number_of: Mapping[int, int]) -> Labels:
    """Return (F,) labels with the joined ids, 0 for instances without one."""
    table = np.zeros(max([int(labels.max(initial=0)), *number_of]) + 1, dtype=np.int32)
    for number, joined in number_of.items():
        table[number] = joined
    return table[labels]


def last_id(labels: Labels, holds: Holds, log: EditLog | None) -> int:
    """Return the highest id of holds that a scan or its edits use."""
    ids = [int(labels.max(initial=0)), *(hold.id for hold in (*holds.holds, *holds.left_out))]
    ids += [_ids_of(edit) for edit in (log.edits if log else ())]
    return max(ids, default=0)


def _ids_of(edit: Edit) -> int:
    numbers: Sequence[int] = [
        ref.id
        for name in edit.__struct_fields__
        for ref in _refs_in(getattr(edit, name))
        if name not in ("route", "routes")
    ]
    return max([*numbers, getattr(edit, "new", 0)], default=0)


def _refs_in(value: object) -> tuple[Ref, ...]:
    if isinstance(value, Ref):
        return (value,)
    return tuple(ref for ref in value if isinstance(ref, Ref)) if isinstance(value, tuple) else ()
