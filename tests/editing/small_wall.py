"""A scan as `classify` and `routes` leave it, by formula: three columns of holds on a flat wall."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from msgspec import structs

from walltopo.core import Mesh
from walltopo.describe.routes.find import describe_route
from walltopo.describe.routes.start_and_top import wall_stats
from walltopo.editing.replay import Outcome, replay
from walltopo.editing.settings import EditSettings
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.scans.edits import Edit, Ref
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import SceneLight
from walltopo.scans.routes import Ambiguous, Routes

WIDTH, HEIGHT, CELL, RADIUS = 4.0, 4.0, 0.05, 0.1
RED, BLUE = (200, 30, 40), (40, 80, 190)
COLUMNS = {1.0: (1, "red", RED), 2.0: (11, "blue", BLUE), 3.0: (21, "red", RED)}
LEFT_OUT, VOLUME = 41, 51


def places() -> dict[int, tuple[float, float, float]]:
    """Hold id to its place: six in each column, 0.6 m apart."""
    found = {
        first + row: (x, 0.0, round(0.4 + 0.6 * row, 1))
        for x, (first, _, _) in COLUMNS.items()
        for row in range(6)
    }
    return found | {LEFT_OUT: (1.4, 0.0, 1.0), VOLUME: (3.6, 0.0, 2.0)}


PLACE = places()


def sheet() -> tuple[Mesh, np.ndarray[tuple[int], np.dtype[np.int32]]]:
    """The plane y = 0 facing -y, and discs on it as labels."""
    nx, nz = round(WIDTH / CELL), round(HEIGHT / CELL)
    gx, gz = np.meshgrid(np.linspace(0, WIDTH, nx + 1), np.linspace(0, HEIGHT, nz + 1))
    vertices = np.stack([gx, np.zeros_like(gx), gz], axis=-1).reshape(-1, 3)
    a = (np.arange(nz)[:, None] * (nx + 1) + np.arange(nx)).ravel()
    b, c, d = a + 1, a + nx + 2, a + nx + 1
    faces = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    mesh = Mesh(vertices, faces)
    labels = np.zeros(len(faces), np.int32)
    for number, place in PLACE.items():
        labels[np.linalg.norm(mesh.centroids - place, axis=1) < RADIUS] = number
    return mesh, labels


def made_holds() -> list[Hold]:
    """The holds of the three columns and the volume."""
    holds = []
    for first, colour, rgb in COLUMNS.values():
        for number in range(first, first + 6):
            holds.append(
                Hold(
                    number,
                    "hold",
                    type="jug",
                    colour=colour,
                    colour_rgb=rgb,
                    position=PLACE[number],
                    size=0.2,
                    review=number == 2,
                )
            )
    volume = Hold(VOLUME, "volume", type="volume", role="volume", position=PLACE[VOLUME], size=0.2)
    return [*holds, volume]


def made_scan(shift: int = 0, moved: float = 0.0) -> ScanSnapshot:
    """Return what an edit starts from.

    Parameters
    ----------
    shift : added to every id; moved : metres by which holds lie farther right: another scan.
    """
    mesh, labels = sheet()
    holds = [_again(hold, shift, moved) for hold in made_holds()]
    doubtful = _again(
        Hold(LEFT_OUT, "hold", colour="red", colour_rgb=RED, position=PLACE[LEFT_OUT], size=0.2),
        shift,
        moved,
    )
    columns = [range(first + shift, first + shift + 6) for first, _, _ in COLUMNS.values()]
    groups = [[hold for hold in holds if hold.id in column] for column in columns]
    unsure = {holds[5].id: {1: 0.6, 2: 0.4}}
    left_out = (structs.replace(doubtful, left_out="few photos confirm it"),)
    around = wall_stats(groups, holds).with_strays([], left_out)
    routes = [
        describe_route(number, group, around, unsure if number == 1 else {})
        for number, group in enumerate(groups, start=1)
    ]
    none = np.zeros((0, 3))
    return ScanSnapshot(
        mesh=mesh,
        labels=np.where(labels > 0, labels + shift, 0).astype(np.int32),
        numbers=frozenset(np.unique(labels[labels > 0] + shift).tolist()),
        found=Holds(metric=True, holds=tuple(holds), left_out=left_out),
        routes=Routes(routes=tuple(routes), volumes=(VOLUME + shift,)),
        light=SceneLight(none, none, none, 0.5, 1.0),
        views=(),
        photos=PhotoSet(Path("photos")),
        settings=EditSettings(),
    )


def _again(hold: Hold, shift: int, moved: float) -> Hold:
    from msgspec.structs import replace

    x, y, z = hold.position
    return replace(hold, id=hold.id + shift, position=(x + moved, y, z))


def ref(number: int) -> Ref:
    """A hold as the scan has it."""
    return Ref(number, PLACE[number])


def route(number: int, by: int) -> Ref:
    """A route, by one of its holds."""
    return Ref(number, PLACE[by])


def after(edits: Sequence[Edit], snapshot: ScanSnapshot | None = None) -> Outcome:
    """Return what a log makes of the small wall."""
    return replay(snapshot or SCAN, list(edits))


def members(outcome: Outcome) -> dict[int, list[int]]:
    """Route id to its holds."""
    return {route.id: sorted(route.holds) for route in outcome.routes.routes}


SCAN = made_scan()
assert isinstance(SCAN.routes.routes[0].ambiguous[0], Ambiguous)
