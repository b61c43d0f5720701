"""`edits.json`: a setter's corrections, an ordered log.

    {"version": 2, "edits": [{"do": "remove", "hold": {"id": 7, "at": [1.2, -0.1, 2.0]}}, ...]}

The log is replayed from its first entry to its last on the scan before any edit, every time anew.
An entry therefore applies once, at its position; undoing the last entry means removing it.

Ids may change from scan to scan, positions hardly do. Every hold is therefore given by its id and
its position (metres, world frame, when the entry was made), and every route by its id and the
position of one of its holds. The replay looks for the position first (`walltopo.editing.replay`).
"""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from walltopo.core.files import write_json
from walltopo.scans.document import Coordinate, Label, read_document

MAX = 50_000  # entries; the largest wall has a few thousand holds
LARGEST_REGION = 1.5  # metres: radius of the largest volume that can be added by a tap

Text = Annotated[str, msgspec.Meta(max_length=200)]
LongText = Annotated[str, msgspec.Meta(max_length=4000)]
# Or empty; a class with such a field checks it.
Date = Annotated[str, msgspec.Meta(max_length=10, extra={"is": "date"})]
Radius = Annotated[float, msgspec.Meta(gt=0, lt=10)]
Place = tuple[Coordinate, Coordinate, Coordinate]
RoleName = Literal["start", "top", "zone", "foot", "hand"]


def check_text(name: str, value: str) -> None:
    """Raise ValueError for a lone surrogate, which no file can store."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise ValueError(f"`{name}` has half a character at {error.start}") from error


class Ref(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """A reference to a hold or a route.

    Parameters
    ----------
    id : its id when the entry was made; 0: none, if an entry allows it.
    at : the hold's position then, or that of one of the route's holds; without it only `id` counts.
    """

    id: Label
    at: Place | None = None


Refs = Annotated[tuple[Ref, ...], msgspec.Meta(min_length=1, max_length=MAX)]
MaybeRefs = Annotated[tuple[Ref, ...], msgspec.Meta(max_length=MAX)]


class _Edit(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    omit_defaults=True,
    forbid_unknown_fields=True,
    tag_field="do",
):
    """An entry; default values are not written."""

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str):
                check_text(name, value)


class SetHold(_Edit, frozen=True, kw_only=True, tag="hold"):
    """Set any of a hold's colours, type and class; an empty second colour: the hold has one."""

    hold: Ref
    colour: Text | None = None
    second_colour: Text | None = None
    type: Text | None = None
    kind: Literal["hold", "volume"] | None = msgspec.field(name="class", default=None)


class Remove(_Edit, frozen=True, kw_only=True, tag="remove"):
    """Mark an instance as no hold."""

    hold: Ref


class Keep(_Edit, frozen=True, kw_only=True, tag="keep"):
    """Restore an instance that the scan or `remove` took for no hold."""

    hold: Ref


class SetRole(_Edit, frozen=True, kw_only=True, tag="role"):
    """Set the role of a hold in its route; "hand": none of the others. Other holds keep theirs."""

    hold: Ref
    route: Ref
    role: RoleName


class Add(_Edit, frozen=True, kw_only=True, tag="add"):
    """Add a hold that the scan missed; it grows from a place to the edge of relief and colour.

    A volume is the whole solid that stands out of the wall there.

    Parameters
    ----------
    hold : its new id (the highest in use + 1; 0: the next free one), and the place.
    kind : "hold" or "volume"; `class` in the file.
    radius : maximum distance of a hold's triangles from the place, metres; `radius_m` in the file.
    """

    hold: Ref
    kind: Literal["hold", "volume"] = msgspec.field(name="class", default="hold")
    radius: Annotated[float, msgspec.Meta(gt=0, le=LARGEST_REGION)] = msgspec.field(
        name="radius_m", default=0.35
    )


class Paint(_Edit, frozen=True, kw_only=True, tag="paint"):
    """Assign the triangles with centroids in a ball to a hold (id 0: to the wall)."""

    hold: Ref
    at: Place
    radius_m: Radius


class Hide(_Edit, frozen=True, kw_only=True, tag="hide"):
    """Hide a ball around a place in the texture and all photos, such as a person in them."""

    at: Place
    radius_m: Radius


class Unhide(_Edit, frozen=True, kw_only=True, tag="unhide"):
    """Show a place again: all hidden balls around it that overlap each other."""

    at: Place


class Cut(_Edit, frozen=True, kw_only=True, tag="cut"):
    """Cut an instance in two, along the line through two places as seen from the front.

    The larger part keeps the id, the other gets `new` (the highest in use + 1; 0: the next free
    one).
    """

    hold: Ref
    points: tuple[Place, Place]
    new: Label


class Join(_Edit, frozen=True, kw_only=True, tag="join"):
    """Join instances under the first one's id, with its attributes."""

    holds: Refs


class Merge(_Edit, frozen=True, kw_only=True, tag="merge"):
    """Merge routes under the first one's id, with its attributes."""

    routes: Refs


class Split(_Edit, frozen=True, kw_only=True, tag="split"):
    """Split holds off their route into a new one, `new` (highest id + 1; 0: the next free id)."""

    route: Ref
    holds: Refs
    new: Label


class Assign(_Edit, frozen=True, kw_only=True, tag="assign"):
    """Assign a hold to a route (id 0: to none)."""

    hold: Ref
    route: Ref


class SetProblem(_Edit, frozen=True, kw_only=True, tag="problem"):
    """Make a new route of existing holds, which stay on their other routes.

    Parameters
    ----------
    hands : holds for hands and feet, from bottom to top; start, top : among them.
    feet : holds for feet only.
    new : its id (the highest in use + 1; 0: the next free one).
    proposed : whether walltopo proposed it and nobody has climbed it yet.
    """

    hands: Refs
    start: Refs
    top: Refs
    feet: MaybeRefs = ()
    new: Label
    proposed: bool = False


class Share(_Edit, frozen=True, kw_only=True, tag="share"):
    """Add a hold to a route; it stays on its own one."""

    hold: Ref
    route: Ref


class Leave(_Edit, frozen=True, kw_only=True, tag="leave"):
    """Remove a hold from a route; its other routes keep it."""

    hold: Ref
    route: Ref


class SetRoute(_Edit, frozen=True, kw_only=True, tag="route"):
    """Set any of a route's attributes; an empty text clears one.

    `date`: ISO, such as 2026-03-01; `proposed`: see `SetProblem`.
    """

    route: Ref
    name: Text | None = None
    colour: Text | None = None
    grade: Text | None = None
    setter: Text | None = None
    description: LongText | None = None
    date: Date | None = None
    proposed: bool | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.date:
            try:
                date.fromisoformat(self.date)
            except ValueError as error:
                raise ValueError(
                    f"`date` is {self.date!r}, expected year-month-day such as 2026-03-01"
                ) from error


Edit = (
    SetHold
    | Remove
    | Keep
    | SetRole
    | Add
    | Paint
    | Hide
    | Unhide
    | Cut
    | Join
    | Merge
    | Split
    | Assign
    | SetProblem
    | Share
    | Leave
    | SetRoute
)


class EditLog(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`edits.json`; the entries apply in their order."""

    version: Literal[2] = 2
    edits: Annotated[tuple[Edit, ...], msgspec.Meta(max_length=MAX)] = ()

    @classmethod
    def load(cls, path: Path) -> EditLog:
        """Return the checked log; InputError names the file and the entry."""
        return read_document(path, cls)

    def save(self, path: Path) -> None:
        """Write the file, atomically."""
        write_json(path, msgspec.to_builtins(self))
