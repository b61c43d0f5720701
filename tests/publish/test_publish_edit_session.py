"""The editor's desk behind the server: tried, saved, and what follows from it written."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from made_scan import build_scan  # type: ignore[import-not-found]
from served import head, served, talk  # type: ignore[import-not-found]
from tests.at_once import at_once

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.errors import EditsChangedError
from walltopo.editing.log_file import EditLogFile
from walltopo.pipeline.edit_session import open_session
from walltopo.pipeline.runner import refresh
from walltopo.publish.server.run import Server
from walltopo.scans.edits import EditLog, Paint, Ref, Remove, SetProblem, SetRole, SetRoute
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.manifest import Manifest
from walltopo.scans.routes import Routes

SMALL = {
    "first_triangles": 1000,
    "detail_triangles": 2000,
    "first_texture": 64,
    "detail_texture": 64,
    "archive_texture": 64,
}


def built(root: Path, holds: int = 12) -> ScanFolder:
    """A small scan, exported once."""
    scan: ScanFolder = build_scan(root, holds=holds, cells=40)
    manifest = Manifest.load(scan.manifest)
    manifest.settings = {"export": SMALL}
    manifest.save(scan.manifest)
    refresh(scan, ("edit", "export"))
    return scan


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with served(
        built(tmp_path_factory.mktemp("desk") / "scan").root, True, opened=open_session
    ) as server:
        yield server


@pytest.fixture(scope="module")
def spray(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A wall with holds enough to set on."""
    scan = built(tmp_path_factory.mktemp("desk") / "spray", holds=40)
    with served(scan.root, True, opened=open_session) as server:
        yield server


def ask(server: Server, path: str, body: object = None) -> Any:
    """Return what the server answers; a body makes it a POST."""
    host = f"localhost:{server.address.port}"
    detail = {"Host": host, "X_Walltopo_Token": server.token, "Connection": "close"}
    data = b"" if body is None else json.dumps(body).encode()
    if body is not None:
        detail |= {
            "Origin": f"http://{host}",
            "Content_Type": "application/json",
            "Content_Length": str(len(data)),
        }
    answer = talk(server, head("GET" if body is None else "POST", path, **detail), data)
    top, _, text = answer.partition(b"\r\n\r\n")
    assert b" 200 " in top.splitlines()[0], text
    return json.loads(text)


def test_problems_are_proposed_for_the_wall_as_a_log_makes_it(spray: Server) -> None:
    before = (spray.scan.root / "routes.json").read_bytes()
    spec = {"grade": "6C-7B", "moves": 3, "count": 1}
    found = ask(spray, "/api/edits/problems", {"edits": log_of(), "spec": spec})
    (one,) = found["proposals"]
    assert found["unit"] == 1
    assert {*one["start"], *one["top"]} <= {*one["hands"]}
    gone = {"do": "remove", "hold": {"id": one["hands"][0]}}
    other = ask(spray, "/api/edits/problems", {"edits": log_of(gone), "spec": spec})
    assert all(one["hands"][0] not in row["hands"] + row["feet"] for row in other["proposals"])
    rows = rows_of(spray.scan)
    parts = {
        name: tuple(Ref(number, rows[number].position) for number in one[name])
        for name in ("hands", "start", "top", "feet")
    }
    edits = msgspec.to_builtins(EditLog(edits=(SetProblem(**parts, new=0, proposed=True),)))
    tried = ask(spray, "/api/edits/try", {"edits": edits})["result"]
    new = next(route for route in tried["routes"] if route["proposed"])
    assert {*new["holds"]} == {*one["hands"], *one["feet"]}
    eased = ask(spray, "/api/edits/ease", {"edits": edits, "route": new["id"], "way": "harder"})
    assert eased["route"] == new["id"]
    assert (spray.scan.root / "routes.json").read_bytes() == before, "nothing is written"


def rows_of(scan: ScanFolder) -> dict[int, Hold]:
    return {row.id: row for row in Holds.load(scan.holds).holds}


def row(scan: ScanFolder, number: int) -> Any:
    return next(hold for hold in Holds.load(scan.holds).holds if hold.id == number)


def log_of(*edits: dict[str, Any]) -> dict[str, Any]:
    return {"version": 2, "edits": list(edits)}


def test_an_edit_is_tried_saved_and_written(running: Server) -> None:
    scan = running.scan
    hold, route = row(scan, 5), Routes.load(scan.routes).routes[0]
    of_route = {"id": route.id, "at": row(scan, route.holds[0]).position}
    x, y, z = hold.position
    edits = log_of(
        {"do": "route", "route": of_route, "name": "Heron", "grade": "6b"},
        {"do": "paint", "hold": {"id": 5, "at": [x, y, z]}, "at": [x, y, z], "radius_m": 0.25},
        {"do": "remove", "hold": {"id": 7, "at": row(scan, 7).position}},
    )
    read = ask(running, "/api/edits")
    assert read["edits"] == {"version": 2, "edits": []}
    before = {path: path.read_bytes() for path in (scan.holds, scan.routes, scan.glb)}
    tried = ask(running, "/api/edits/try", {"edits": edits})["result"]
    assert tried["notes"] == []
    assert tried["routes"][0]["name"] == "Heron"
    assert [r["left_out"] for r in tried["holds"] if r["id"] == 7] == ["taken out by hand"]
    assert {path: path.read_bytes() for path in before} == before, "a try writes nothing"
    assert not scan.edits.exists()

    saved = ask(running, "/api/edits", {"version": read["version"], "edits": edits})
    assert saved["result"]["holds"] == tried["holds"]
    wait_until_written(running)
    assert Routes.load(scan.routes).routes[0].grade == "6b"
    assert 7 not in {r.id for r in Holds.load(scan.holds).holds}
    assert b"Heron" in scan.glb.read_bytes()
    assert "Heron" in scan.report.read_text(encoding="utf-8")
    # The written holds equal those of the trial.
    shown = {r["id"]: r for r in tried["holds"] if not r["left_out"]}
    written = json.loads(scan.holds.read_text(encoding="utf-8"))["holds"]
    of_page = {"cutout"}
    output = [{k: v for k, v in shown[r["id"]].items() if k not in of_page} for r in written]
    assert output == written
    assert Manifest.load(scan.manifest).stages["edit"].metrics["edits"] == 3


def test_a_result_says_what_differs_from_the_patches_of_the_tiers(running: Server) -> None:
    hold = row(running.scan, 3)
    x, y, z = hold.position
    paint = {"do": "paint", "hold": {"id": 3, "at": [x, y, z]}, "at": [x, y, z], "radius_m": 0.3}
    surface = ask(running, "/api/edits/try", {"edits": log_of(paint)})["result"]["surface"]
    (painted,) = [group for group in surface["changed"] if group["label"] == 3]
    places = np.array(painted["places"]).reshape(-1, 3).cumsum(axis=0) * surface["step"]
    places += surface["origin"]
    assert len(places) > 10
    assert (np.linalg.norm(places - hold.position, axis=1) < 0.3 + surface["step"]).all()
    assert surface["unchanged"], "the triangles around say where the change ends"
    # Taken back, everything is as the tiers have it.
    back = ask(running, "/api/edits/try", {"edits": log_of()})["result"]["surface"]
    assert back["changed"] == []


def test_photos_of_a_place(running: Server) -> None:
    x, y, z = row(running.scan, 5).position
    photos = ask(running, f"/api/photos?at={x},{y},{z}")["photos"]
    assert photos
    assert all(photo["picture"].startswith("data:image/jpeg;base64,") for photo in photos)
    assert all(0 <= photo["x"] <= 1 and 0 <= photo["y"] <= 1 for photo in photos)


def wait_until_written(server: Server) -> None:
    """Until no run is at work; it ends by itself, or the test's own limit ends it."""
    pause = threading.Event()
    while (state := ask(server, "/api/edits/state"))["running"]:
        pause.wait(0.05)
    assert state["problem"] == ""
    assert not state["stale"]
    assert state["done_version"] == EditLogFile(server.scan).version()


class KeptLog:
    """Keeps a log outside of the folder, as a database does."""

    def __init__(self, scan: ScanFolder) -> None:
        self._scan, self._logs = scan, [EditLog()]

    def version(self) -> str:
        return str(len(self._logs))

    def read(self) -> tuple[EditLog, str]:
        return self._logs[-1], self.version()

    def save(self, log: EditLog, version: str) -> str:
        assert version == self.version()
        self._logs.append(log)
        return self.version()

    def copy_to_folder(self) -> str:
        self._logs[-1].save(self._scan.edits)
        return self.version()


def test_a_log_may_be_kept_outside_of_the_folder(tmp_path: Path) -> None:
    scan = built(tmp_path / "scan")
    store, rebuilt = KeptLog(scan), list[str]()
    session = open_session(scan, store, rebuilt.append)
    log = EditLog(edits=(SetRoute(route=Ref(1), name="Owl"),))
    assert session.save(log, "1")[1] == "2"
    session.close()
    state = session.status()
    assert (state.stale, state.done_version, rebuilt) == (False, "2", ["2"])
    assert EditLog.load(scan.edits) == log
    assert Routes.load(scan.routes).routes[0].name == "Owl"


def test_what_cannot_follow_is_reported(tmp_path: Path) -> None:
    scan = built(tmp_path / "scan")
    session = open_session(scan)
    assert not session.status().stale
    scan.texture.unlink()
    session.save(EditLog(edits=(SetRoute(route=Ref(1), name="Owl"),)), session.read()[1])
    session.close()
    state = session.status()
    assert state.stale
    assert "texture" in state.problem
    assert EditLog.load(scan.edits).edits, "the log is safe"


def test_of_many_who_save_on_the_same_log_one_does(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    version = EditLogFile(scan).version()
    saved, refused = [], []

    def one(number: int) -> None:
        log = EditLog(edits=(SetRoute(route=Ref(1), name=f"route of {number}"),))
        try:
            saved.append((log, EditLogFile(scan).save(log, version)))
        except EditsChangedError:
            refused.append(number)

    at_once(*(partial(one, number) for number in range(8)))
    assert (len(saved), len(refused)) == (1, 7)
    assert EditLogFile(scan).read() == saved[0]


def test_a_full_disk_leaves_the_log_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan = ScanFolder(tmp_path)
    first = EditLog(edits=(Remove(hold=Ref(1)),))
    version = EditLogFile(scan).save(first, EditLogFile(scan).version())

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(EditLog, "save", full)
    with pytest.raises(EnvironmentLacksError, match="no space left"):
        EditLogFile(scan).save(EditLog(), version)
    assert EditLog.load(scan.edits) == first
    assert not list(scan.root.glob(".partial-*"))


def test_edits_by_hand_count_as_a_change(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    version = EditLogFile(scan).save(EditLog(), EditLogFile(scan).version())
    by_hand = EditLog(edits=(Remove(hold=Ref(1)),))
    by_hand.save(scan.edits)
    with pytest.raises(EditsChangedError):
        EditLogFile(scan).save(EditLog(), version)
    assert EditLog.load(scan.edits) == by_hand


def test_something_in_the_way_is_reported(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    scan.edits.mkdir()
    with pytest.raises(InputError, match="is not a file"):
        EditLogFile(scan).save(EditLog(), EditLogFile(scan).version())


def test_roles_reach_every_table(tmp_path: Path) -> None:
    import csv

    from walltopo.publish.convert import convert
    from walltopo.publish.wall_data import read_wall

    scan = built(tmp_path / "scan")
    route = Routes.load(scan.routes).routes[0]
    first, second = (row(scan, number) for number in route.holds[:2])
    of_route = Ref(route.id, first.position)
    log = EditLog(
        edits=(
            SetRole(hold=Ref(second.id, second.position), route=of_route, role="zone"),
            SetRoute(route=of_route, grade="6b", setter="=Ada", date="2026-03-01"),
            Paint(hold=Ref(0), at=row(scan, 9).position, radius_m=0.01),
        )
    )
    EditLogFile(scan).save(log, EditLogFile(scan).version())
    refresh(scan, ("edit", "export"))
    convert(read_wall(scan), "csv", tmp_path / "wall.csv")
    routes = list(csv.DictReader((tmp_path / "wall.routes.csv").open(encoding="utf-8")))
    assert (routes[0]["grade"], routes[0]["setter"], routes[0]["date"]) == (
        "6b",
        "'=Ada",
        "2026-03-01",
    )
    assert routes[0]["zone"] == str(second.id)
    holds = {line["id"]: line for line in csv.DictReader((tmp_path / "wall.csv").open())}
    assert holds[str(second.id)]["part"] == "zone"
    assert b'"grade":"6b"' in scan.glb.read_bytes()
