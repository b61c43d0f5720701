"""Edit files, what they do to the export, and the server that saves them."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.export.edits import EditDocument, read_edits, save_edits
from walltopo.export.server import make_server
from walltopo.export.wall import read_wall
from walltopo.scans.attributes import Attributes
from walltopo.scans.edits import HoldEdit, HoldEdits, Rename, RouteEdits, Stroke, apply_strokes
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]
HERE = (1.0, -0.1, 2.0)


def rename(name: str) -> RouteEdits:
    return RouteEdits(rename=(Rename(route=1, at=HERE, name=name),))


def save(scan: ScanFolder, edits: HoldEdits) -> None:
    """Save as the editor does."""
    save_edits(scan, msgspec.to_builtins(EditDocument(edits, RouteEdits())))


def delete_hold(scan: ScanFolder, number: int) -> None:
    """What the classify stage does about a deleted hold: it is not in attributes.json."""
    found = Attributes.load(scan.attributes)
    kept = tuple(hold for hold in found.instances if hold.id != number)
    msgspec.structs.replace(found, instances=kept).save(scan.attributes)


@given(name=st.text(max_size=60))
def test_any_name_survives_toml(tmp_path_factory: pytest.TempPathFactory, name: str) -> None:
    name = name.encode("utf-8", "ignore").decode()
    path = tmp_path_factory.mktemp("edits") / "routes.edits.toml"
    rename(name).save(path)
    assert RouteEdits.load(path) == rename(name)


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ({"holds": {}, "routes": {"blow": []}}, "blow"),
        ({"holds": {}, "routes": {"assign": [{"hold": 1, "at": HERE}]}}, "`route`"),
        ({"holds": {"holds": [{"id": -1, "at": HERE}]}, "routes": {}}, r"\.id"),
        ({"holds": {"holds": [{"id": 1, "at": [0, 0]}]}, "routes": {}}, r"\.at"),
        ({"holds": {"strokes": 3}, "routes": {}}, "strokes"),
        ({"holds": {}}, "`routes`"),
    ],
)
def test_broken_edits_are_refused_and_nothing_is_written(
    make_scan: MakeScan, edits: Any, message: str
) -> None:
    scan = make_scan(cells=20)
    with pytest.raises(InputError, match=message):
        save_edits(scan, edits)
    assert not scan.hold_edits.exists()
    assert not scan.route_edits.exists()


def test_strokes_and_deleted_holds_reach_the_model(make_scan: MakeScan) -> None:
    scan = make_scan()
    plain = read_wall(scan)
    x, y, z = plain.mesh.centroids[np.flatnonzero(plain.face_instance == 0)[100]].tolist()
    place = (x, y, z)
    save(scan, HoldEdits(strokes=(Stroke(hold=3, at=place, radius_m=0.2),)))
    delete_hold(scan, 7)
    painted = read_wall(scan)
    near = np.linalg.norm(plain.mesh.centroids - place, axis=1) <= 0.2
    assert (painted.face_instance[near] == 3).all()
    assert not (painted.face_instance == 7).any()


def test_strokes_give_the_model_the_triangles_that_classify_measures(make_scan: MakeScan) -> None:
    scan = make_scan()
    plain = read_wall(scan)
    x, y, z = plain.mesh.centroids[np.flatnonzero(plain.face_instance == 3)[0]].tolist()
    strokes = (
        Stroke(hold=7, at=(x, y, z), radius_m=0.1),  # by a hold that is deleted afterwards
        Stroke(hold=0, at=plain.holds[0].position, radius_m=0.05),
        Stroke(hold=5, at=plain.holds[0].position, radius_m=0.02),
    )
    deleted = HoldEdit(id=7, at=plain.holds[6].position, deleted=True)
    save(scan, HoldEdits(holds=(deleted,), strokes=strokes))
    delete_hold(scan, 7)
    expected = apply_strokes(plain.mesh, plain.face_instance, strokes)
    assert (expected != plain.face_instance).any()
    assert (expected == 7).sum() > (plain.face_instance == 7).sum()
    expected[expected == 7] = 0
    np.testing.assert_array_equal(read_wall(scan).face_instance, expected)


@pytest.fixture
def server(make_scan: MakeScan, request: pytest.FixtureRequest) -> Iterator[tuple[int, ScanFolder]]:
    scan = make_scan(cells=20)
    scan.page.write_text("<wall-topo src=x></wall-topo>")
    (scan.root / "page").mkdir()
    running = make_server(scan.root, 0, edit=getattr(request, "param", True))
    threading.Thread(target=running.serve_forever, daemon=True).start()
    yield int(running.server_address[1]), scan
    running.shutdown()
    running.server_close()


def ask(
    port: int, method: str, path: str, body: str | None = None, **headers: str
) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    named = {key.replace("_", "-"): value for key, value in headers.items()}
    connection.request(method, path, body, named)
    answer = connection.getresponse()
    return answer.status, answer.read().decode("utf-8", "replace")


def test_serves_the_page_and_nothing_else(server: tuple[int, ScanFolder]) -> None:
    port, _ = server
    assert ask(port, "GET", "/")[0] == 200
    for path in ("/scan.json", "/photos/IMG_1.jpg", "/page/../scan.json", "/page/%2e%2e/scan.json",
                 "/../../etc/passwd", "//etc/passwd", "/page"):  # fmt: skip
        assert ask(port, "GET", path)[0] == 404, path
    assert ask(port, "GET", "/", Host="evil.example")[0] == 403


def test_saves_edits_of_its_own_page_only(server: tuple[int, ScanFolder]) -> None:
    port, scan = server
    body = json.dumps({"holds": {}, "routes": msgspec.to_builtins(rename("Heron"))})
    own = {"Content_Type": "application/json", "Host": f"localhost:{port}"}
    foreign = ask(port, "POST", "/api/edits", body, **own, Origin="http://evil.example")
    assert foreign[0] == 403
    assert ask(port, "POST", "/api/edits", body, Host=f"localhost:{port}")[0] == 415
    assert ask(port, "POST", "/api/edits", "{", **own)[0] == 400
    assert not scan.route_edits.exists()
    assert ask(port, "POST", "/api/edits", body, **own, Origin=f"http://localhost:{port}")[0] == 200
    assert read_edits(scan)["routes"]["rename"][0]["name"] == "Heron"
    assert "<wall-topo edit " in ask(port, "GET", "/")[1]


@pytest.mark.parametrize("server", [False], indirect=True)
def test_without_edit_nothing_is_saved(server: tuple[int, ScanFolder]) -> None:
    port, scan = server
    headers = {"Content_Type": "application/json"}
    assert ask(port, "POST", "/api/edits", "{}", **headers)[0] == 404
    assert ask(port, "GET", "/api/edits")[0] == 404
    assert " edit " not in ask(port, "GET", "/")[1]
    assert not scan.hold_edits.exists()
