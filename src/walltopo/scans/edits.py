"""`edits.json`: a setter's corrections, an ordered log.

    {"version": 2, "edits": [{"do": "remove", "hold": {"id": 7, "at": [1.2, -0.1, 2.0]}}, ...]}

The log is replayed from what the scan found, from its first entry to its last, every time anew: so
an entry counts once, in its place, and to take the last one back is to drop it.

Ids may change from scan to scan, places hardly do. So every hold is given by its id and its
position (metres, world frame; as it was when the entry was made), every route by its id and the
position of one of its holds; the replay looks for the place first (`walltopo.editing.replay`).
"""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from walltopo.core.files import write_json
from walltopo.scans.document import Coordinate, Label, read_document

MOST = 50_000  # entries; the largest wall has some thousand holds
LARGEST_REGION = 1.5  # metres: radius of the largest volume that may be added by a tap

Text = Annotated[str, msgspec.Meta(max_length=200)]
LongText = Annotated[str, msgspec.Meta(max_length=4000)]
# Or empty; the class that has one checks it.
Date = Annotated[str, msgspec.Meta(max_length=10, extra={"is": "date"})]
Radius = Annotated[float, msgspec.Meta(gt=0, lt=10)]
Place = tuple[Coordinate, Coordinate, Coordinate]
RoleName = Literal["start", "top", "zone", "foot", "hand"]


def check_text(name: str, value: str) -> None:
    """Refuse half a surrogate pair, which is no text: no file can hold it."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise ValueError(f"`{name}` has half a character at {error.start}") from error


class Ref(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """A hold, or a route.

    Parameters
    ----------
    id : its id when the entry was made; 0: none, where an entry allows it.
    at : the hold's position then; of a route: that of a hold of it. Without it the id alone counts.
    """

    id: Label
    at: Place | None = None


Refs = Annotated[tuple[Ref, ...], msgspec.Meta(min_length=1, max_length=MOST)]
MaybeRefs = Annotated[tuple[Ref, ...], msgspec.Meta(max_length=MOST)]


class _Edit(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    omit_defaults=True,
    forbid_unknown_fields=True,
    tag_field="do",
):
    """An entry; what was not given is not written."""

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if isinstance(value, str):
                check_text(name, value)


class SetHold(_Edit, frozen=True, kw_only=True, tag="hold"):
    """Any of a hold's colour, type and class."""

    hold: Ref
    colour: Text | None = None
    type: Text | None = None
    kind: Literal["hold", "volume"] | None = msgspec.field(name="class", default=None)


class Remove(_Edit, frozen=True, kw_only=True, tag="remove"):
    """This is no hold."""

    hold: Ref


class Keep(_Edit, frozen=True, kw_only=True, tag="keep"):
    """An instance that was left out (by the scan, or by `remove`) is a hold after all."""

    hold: Ref


class SetRole(_Edit, frozen=True, kw_only=True, tag="role"):
    """What a hold is in its route; "hand": none of the others. It says nothing of other holds."""

    hold: Ref
    route: Ref
    role: RoleName


class Add(_Edit, frozen=True, kw_only=True, tag="add"):
    """A hold that the scan missed: grows on the surface from a place to the edge of relief and
    colour.

    Parameters
    ----------
    hold : its new id (the highest in use + 1; 0: the next free one), and the place.
    radius : no part of it is farther from the place, metres; `radius_m` in the file.
    """

    hold: Ref
    radius: Annotated[float, msgspec.Meta(gt=0, le=LARGEST_REGION)] = msgspec.field(
        name="radius_m", default=0.35
    )


class Paint(_Edit, frozen=True, kw_only=True, tag="paint"):
    """A ball: the triangles whose centroid lies in it go to the hold (id 0: to the wall)."""

    hold: Ref
    at: Place
    radius_m: Radius


class Cut(_Edit, frozen=True, kw_only=True, tag="cut"):
    """An instance becomes two, along the line through two places as seen from before the wall.

    The larger part keeps the id, the other gets `new` (the highest in use + 1;
    0: the next free one).
    """

    hold: Ref
    points: tuple[Place, Place]
    new: Label


class Join(_Edit, frozen=True, kw_only=True, tag="join"):
    """Instances become one, under the first one's id, with its attributes."""

    holds: Refs


class Merge(_Edit, frozen=True, kw_only=True, tag="merge"):
    """Routes become one, under the first one's id, with its attributes."""

    routes: Refs


class Split(_Edit, frozen=True, kw_only=True, tag="split"):
    """Holds leave their route and make one of their own, `new` (the highest in use + 1; 0: the next
    free one)."""

    route: Ref
    holds: Refs
    new: Label


class Assign(_Edit, frozen=True, kw_only=True, tag="assign"):
    """A hold belongs to a route (id 0: to none)."""

    hold: Ref
    route: Ref


class SetProblem(_Edit, frozen=True, kw_only=True, tag="problem"):
    """A new route on holds that hang. They stay on the routes that they are on.

    Parameters
    ----------
    hands : holds for hands and feet, from bottom to top; start, top : those of them.
    feet : holds for feet alone.
    new : its id (the highest in use + 1; 0: the next free one).
    proposed : by walltopo, and climbed by nobody yet.
    """

    hands: Refs
    start: Refs
    top: Refs
    feet: MaybeRefs = ()
    new: Label
    proposed: bool = False


class Share(_Edit, frozen=True, kw_only=True, tag="share"):
    """A hold is of this route too, and stays on the one that it is on."""

    hold: Ref
    route: Ref


class Leave(_Edit, frozen=True, kw_only=True, tag="leave"):
    """A hold is not of this route any more; its others keep it."""

    hold: Ref
    route: Ref


class SetRoute(_Edit, frozen=True, kw_only=True, tag="route"):
    """Any of a route's attributes; empty text clears one. `date`: ISO, such as 2026-03-01;
    `proposed`: see `SetProblem`."""

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
    """`edits.json`; the entries count in their order."""

    version: Literal[2] = 2
    edits: Annotated[tuple[Edit, ...], msgspec.Meta(max_length=MOST)] = ()

    @classmethod
    def load(cls, path: Path) -> EditLog:
        """Read and check. InputError names the file and the entry."""
        return read_document(path, cls)

    def save(self, path: Path) -> None:
        """Write, atomically."""
        write_json(path, msgspec.to_builtins(self))
