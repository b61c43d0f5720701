"""`holds.edits.json` and `routes.edits.toml`: where corrections were kept before `edits.json`.

They are read where there is no `edits.json`; `as_log` tells what they mean there.

`holds.edits.json`::

    {"version": 1,
     "holds": [{"id": 7, "at": [x, y, z], "colour": "red", "type": "jug", "deleted": true}],
     "strokes": [{"hold": 7, "at": [x, y, z], "radius_m": 0.03}]}

`routes.edits.toml`, applied from top to bottom within each kind, in this order of kinds::

    version = 1
    [[merge]]                      # both become one route, under the first one's id
    routes = [3, 5]
    at = [[x, y, z], [x, y, z]]    # a hold of each
    [[split]]                      # these holds leave their route and make one of their own
    route = 3
    holds = [12, 14]
    at = [[x, y, z], [x, y, z]]    # of the holds
    [[assign]]                     # this hold belongs to that route; route 0: to none
    hold = 12
    at = [x, y, z]
    route = 4
    route_at = [x, y, z]           # a hold of the route
    [[rename]]
    route = 4
    at = [x, y, z]                 # a hold of the route
    name = "The Owl"
    [[colour]]
    route = 4
    at = [x, y, z]
    colour = "red"
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from walltopo.core.files import atomic_path, write_json
from walltopo.core.toml import read_toml
from walltopo.scans import edits as log
from walltopo.scans.bounds import Label
from walltopo.scans.document import parse, read_document
from walltopo.scans.edits import MOST, Place, Radius, Ref, Text, check_text

__all__ = [
    "Assign",
    "HoldEdit",
    "HoldEdits",
    "Merge",
    "Recolour",
    "Rename",
    "RouteEdits",
    "Split",
    "Stroke",
    "as_log",
]

Labels = Annotated[tuple[Label, ...], msgspec.Meta(max_length=MOST)]
Places = Annotated[tuple[Place, ...], msgspec.Meta(max_length=MOST)]


class _Edit(
    msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=True
):
    """An entry; what was not given is not written."""

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str):
                check_text(name, value)


def _check_pairs(what: str, ids: Labels, at: Places) -> None:
    """Each id with its place: one without the other would be dropped when the edit is applied."""
    if len(ids) != len(at):
        raise ValueError(f"`{what}` has {len(ids)} ids, but `at` has {len(at)} places")


class HoldEdit(_Edit, frozen=True, kw_only=True):
    """A correction of one hold: any of its colour, type and class; or that it is none
    (`deleted`), or that a doubtful instance is one after all (`kept`)."""

    id: Label
    at: Place
    colour: Text | None = None
    type: Text | None = None
    kind: Literal["hold", "volume"] | None = msgspec.field(name="class", default=None)
    deleted: bool = False
    kept: bool = False


class Stroke(_Edit, frozen=True, kw_only=True):
    """A ball: the triangles whose centroid lies in it go to the hold (0: to the wall)."""

    hold: Label
    at: Place
    radius_m: Radius


class Merge(_Edit, frozen=True, kw_only=True):
    """Routes that become one, under the first one's id; `at`: a hold of each."""

    routes: Labels
    at: Places

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_pairs("routes", self.routes, self.at)


class Split(_Edit, frozen=True, kw_only=True):
    """Holds that leave their route and make one of their own; `at`: of the holds."""

    route: Label
    holds: Labels
    at: Places

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_pairs("holds", self.holds, self.at)


class Assign(_Edit, frozen=True, kw_only=True):
    """A hold that belongs to a route (0: to none); `route_at`: a hold of the route."""

    hold: Label
    at: Place
    route: Label
    route_at: Place | None = None


class Rename(_Edit, frozen=True, kw_only=True):
    """A route's name; `at`: a hold of the route."""

    route: Label
    at: Place
    name: Text


class Recolour(_Edit, frozen=True, kw_only=True):
    """A route's colour; `at`: a hold of the route."""

    route: Label
    at: Place
    colour: Text


_AT_MOST = msgspec.Meta(max_length=MOST)


class _Edits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    version: Literal[1] = 1


class HoldEdits(_Edits, frozen=True, kw_only=True):
    """`holds.edits.json`; both lists count in their order."""

    holds: Annotated[tuple[HoldEdit, ...], _AT_MOST] = ()
    strokes: Annotated[tuple[Stroke, ...], _AT_MOST] = ()

    @classmethod
    def load(cls, path: Path) -> HoldEdits:
        """Read; none where the file is absent. InputError names the file and the entry."""
        return read_document(path, cls) if path.is_file() else cls()

    def save(self, path: Path) -> None:
        """Write, atomically."""
        write_json(path, msgspec.to_builtins(self))


class RouteEdits(_Edits, frozen=True, kw_only=True):
    """`routes.edits.toml`."""

    merge: Annotated[tuple[Merge, ...], _AT_MOST] = ()
    split: Annotated[tuple[Split, ...], _AT_MOST] = ()
    assign: Annotated[tuple[Assign, ...], _AT_MOST] = ()
    rename: Annotated[tuple[Rename, ...], _AT_MOST] = ()
    colour: Annotated[tuple[Recolour, ...], _AT_MOST] = ()

    @classmethod
    def load(cls, path: Path) -> RouteEdits:
        """Read; none where the file is absent. InputError names the file and the entry."""
        if not path.is_file():
            return cls()
        return parse(read_toml(path), cls, str(path))

    def save(self, path: Path) -> None:
        """Write, atomically."""
        entries: dict[str, Any] = msgspec.to_builtins(self)
        lines = ["# Corrections of routes; applied on every run of the scan.", "version = 1"]
        for kind in ("merge", "split", "assign", "rename", "colour"):
            for entry in entries[kind]:
                lines += ["", f"[[{kind}]]"]
                # JSON's strings, numbers and lists are TOML's too.
                lines += [
                    f"{key} = {json.dumps(v, ensure_ascii=False)}".replace("\x7f", "\\u007f")
                    for key, v in entry.items()
                ]
        with atomic_path(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def as_log(holds: HoldEdits, routes: RouteEdits) -> log.EditLog:
    """What both files mean: strokes first, then holds, then routes in the order of their kinds."""
    return log.EditLog(edits=(*_of_holds(holds), *_of_routes(routes)))


def _of_holds(edits: HoldEdits) -> Iterator[log.Edit]:
    for stroke in edits.strokes:
        # A stroke knows its hold by the id alone: its place is where it paints.
        yield log.Paint(hold=Ref(stroke.hold), at=stroke.at, radius_m=stroke.radius_m)
    for edit in edits.holds:
        hold = Ref(edit.id, edit.at)
        if edit.kept:
            yield log.Keep(hold=hold)
        if edit.deleted:
            yield log.Remove(hold=hold)
        elif not edit.kept or edit.colour or edit.type or edit.kind:
            yield log.SetHold(hold=hold, colour=edit.colour, type=edit.type, kind=edit.kind)


def _of_routes(edits: RouteEdits) -> Iterator[log.Edit]:
    for merge in edits.merge:
        if merge.routes:
            yield log.Merge(routes=tuple(map(Ref, merge.routes, merge.at)))
    for split in edits.split:
        if split.holds:
            yield log.Split(
                route=Ref(split.route), holds=tuple(map(Ref, split.holds, split.at)), new=0
            )
    for assign in edits.assign:
        yield log.Assign(hold=Ref(assign.hold, assign.at), route=Ref(assign.route, assign.route_at))
    for rename in edits.rename:
        yield log.SetRoute(route=Ref(rename.route, rename.at), name=rename.name)
    for recolour in edits.colour:
        yield log.SetRoute(route=Ref(recolour.route, recolour.at), colour=recolour.colour)
