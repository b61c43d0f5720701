"""From photos to a wall in review, the server killed on the way: program and scan are real."""

from __future__ import annotations

import json
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from gym.tests.hurried import forget_jobs
from gym.tests.running import QUICK, Process, announce, browser, send, wait_for
from gym.tests.worlds import Server, World, make_world
from numpy.typing import NDArray
from PIL import Image

from walltopo.pipeline.plan import names_of_plan
from walltopo.scans.colmap_model import open_model
from walltopo_gym.jobs.worker_slot import count_living_workers


def _manifest(data: Path, scan: str) -> dict[str, Any]:
    """Return what the shelf knows of the scan's stages."""
    path = data / "files" / "scans" / scan / "scan.json"
    if not path.is_file():
        return {}
    stages: dict[str, Any] = json.loads(path.read_text())["stages"]
    return {name: record for name, record in stages.items() if record["state"] == "done"}


def _scan(client: httpx.Client, path: str) -> dict[str, Any]:
    answer = client.get(path)
    assert answer.status_code == 200, answer.text
    facts: dict[str, Any] = answer.json()
    return facts


def test_a_worker_takes_what_is_queued_and_says_why_it_fails(server: Server) -> None:
    """Two gyms' scans of what is no photo, on each database, by `walltopo gym worker`."""
    worlds = [make_world(server) for _ in range(2)]
    server.services.store.put("originals/None", b"no photo")
    scans = []
    for world in worlds:
        scan = world.scan(usable=3)
        path = f"{world.path}/scans/{scan}"
        assert server.ask("POST", f"{path}/start", world.people["setter"]).status_code == 200
        scans.append((world, path))
    settings = {"database": server.settings.database} if server.settings.database else {}
    worker = Process(server.settings.data, "worker", **settings)
    try:
        for world, path in scans:

            def ended(world: World = world, path: str = path) -> dict[str, Any]:
                facts = server.ask("GET", path, world.people["setter"]).json()
                return facts if facts["state"] == "failed" else {}

            facts = wait_for(ended)
            assert "usable" in facts["error"]
            assert "Add photos" in facts["hint"]
    finally:
        worker.stop()


@pytest.mark.slow
def test_another_worker_goes_on_when_one_is_killed(server: Server) -> None:
    """One is killed over three photos of noise; the other ends what it had begun."""
    world = make_world(server)
    scan = world.scan()
    for number in range(3):
        content = BytesIO()
        Image.effect_noise((640, 480), 70 + number).convert("RGB").save(content, "JPEG")
        server.services.store.put(f"originals/noise{number}", content.getvalue())
        world.photo(scan, state="usable", sha256=f"noise{number}")
    path, setter = f"{world.path}/scans/{scan}", world.people["setter"]
    settings = {"database": server.settings.database} if server.settings.database else {}
    forget_jobs(server)
    data = server.settings.data
    workers: list[Process] = []
    try:
        for number in range(2):
            workers.append(Process(data, "worker", **settings))
            wait_for(partial(_live, server, number + 1))
        assert server.ask("POST", f"{path}/start", setter).status_code == 200
        at_work = wait_for(lambda: list((data / "work").glob(f"*/{scan}/scan")))[0]
        busy = int(at_work.parts[-3].rpartition("-")[2])
        workers[busy].kill()
        ended = wait_for(
            lambda: (facts := server.ask("GET", path, setter).json())["state"] == "failed" and facts
        )
        assert "fault of the program" not in ended["error"]
        assert ended["error"]
        assert _live(server, 1)
    finally:
        for worker in workers:
            worker.stop()


def _live(server: Server, number: int) -> bool:
    """Return whether so many workers live."""
    return count_living_workers(server.settings, server.database) == number


def _check_scaling(client: httpx.Client, path: str, data: Path, scan: str) -> None:
    """Give two points of the scan a distance of 2 m; only the stages from `scale` on run again."""
    before, done = _points(data, scan), _manifest(data, scan)
    ordered = sorted(before, key=lambda number: before[number][0])
    a, b = ordered[len(ordered) // 5], ordered[4 * len(ordered) // 5]
    body = {"points": [before[a].tolist(), before[b].tolist()], "metres": 2.0}
    assert client.post(f"{path}/distance", json=body).json()["state"] == "queued"
    ended = wait_for(
        lambda: (facts := _scan(client, path))["state"] in ("review", "failed") and facts
    )
    assert (ended["state"], ended["scale"]["method"]) == ("review", "distance"), ended
    after, again = _points(data, scan), _manifest(data, scan)
    assert np.linalg.norm(after[a] - after[b]) == pytest.approx(2.0, rel=1e-3)
    assert again["sparse"] == done["sparse"]
    assert again["dense"] != done["dense"]


def _points(data: Path, scan: str) -> dict[int, NDArray[np.float64]]:
    model = open_model(data / "files/scans" / scan / "sparse")
    return {number: np.array(point.xyz) for number, point in model.points3D.items()}


@pytest.mark.slow
def test_a_scan_outlives_its_server(tmp_path: Path, tiny_photos: Path) -> None:
    world = make_world(Server(tmp_path))
    world.server.close()
    (tmp_path / "quick.toml").write_text(QUICK)
    settings = {"scan_settings": str(tmp_path / "quick.toml")}
    cookie = world.people["setter"].headers["cookie"].partition("=")[2]
    process = Process(tmp_path, "serve", "--port", "0", **settings)
    try:
        client = browser(process.first_line, cookie)
        begun = client.post(f"{world.path}/walls/{world.wall.id}/scans").json()
        path = f"{world.path}/scans/{begun['id']}"
        for file in sorted(tiny_photos.iterdir()):
            content = file.read_bytes()
            place = announce(client, f"{path}/photos", file.name, content).headers["location"]
            assert send(client, place, content).status_code == 204
        wait_for(lambda: {p["state"] for p in client.get(f"{path}/photos").json()} == {"usable"})
        assert sum(p["plate_frames"] for p in client.get(f"{path}/photos").json()) > 1
        assert client.post(f"{path}/start").status_code == 200
        before = wait_for(lambda: "sparse" in (done := _manifest(tmp_path, begun["id"])) and done)
        process.kill()
        assert "export" not in before
        process = Process(tmp_path, "serve", "--port", "0", **settings)
        client = browser(process.first_line, cookie)
        ended = wait_for(
            lambda: (facts := _scan(client, path))["state"] in ("review", "failed") and facts
        )
        assert ended["state"] == "review", ended
        assert ended["scale"]["method"] == "measure"
        assert ended["scale"]["metric"]
        after = _manifest(tmp_path, begun["id"])
        # Stages that ended before the kill did not run again.
        assert {name: after[name] for name in before} == before
        assert tuple(after) == names_of_plan(part=False)
        wait_for(lambda: not list((tmp_path / "work").rglob(begun["id"])))
        # Started again in review: no.
        assert client.post(f"{path}/start").status_code == 409
        _check_scaling(client, path, tmp_path, begun["id"])
        _edit_it(client, path)
    finally:
        process.stop()


def _edit_it(client: httpx.Client, path: str) -> None:
    """The editor on the scan in review: tried, saved by one of two, carried out, then published."""
    log = f"{path}/editor/log"
    holds = _shown(client, path, "holds.json")["holds"]
    edit = {"do": "remove", "hold": {"id": holds[0]["id"], "at": holds[0]["position"]}}
    edits = {"version": 2, "edits": [edit]}
    before = _scan(client, log)
    assert before == {"version": "0", "edits": {"version": 2, "edits": []}}
    tried = client.post(f"{log}/try", json={"edits": edits}).json()["result"]
    gone = next(row for row in tried["holds"] if row["id"] == holds[0]["id"])
    assert gone["left_out"]
    hard = client.post(f"{log}/problems", json={"edits": edits, "spec": {"grade": "hard"}})
    assert "not a boulder grade" in hard.json()["title"]
    nowhere = {"edits": edits, "route": 9999, "way": "easier"}
    assert "route 9999 does not exist" in client.post(f"{log}/ease", json=nowhere).json()["title"]
    saved_log = {"version": before["version"], "edits": edits}
    assert client.post(log, json=saved_log).json()["version"] == "1"
    second = client.post(log, json=saved_log)
    assert second.status_code == 409
    assert "saved edits since" in second.json()["title"]
    at = ",".join(map(str, holds[0]["position"]))
    photos = client.get(f"{path}/editor/photos", params={"at": at})
    assert photos.json()["photos"]
    state = wait_for(lambda: _settled(_scan(client, f"{log}/state")))
    assert (state["done_version"], state["problem"]) == ("1", "")
    after = _shown(client, path, "holds.json")["holds"]
    assert [row["id"] for row in after] == [row["id"] for row in holds[1:]]
    draft = client.get(f"{path}/draft").json()
    body = {"revision": draft["revision"], "routes": []}
    assert client.post(f"{path}/publish", json=body).status_code == 200
    assert client.get(log).status_code == 409  # it is published
    _amend_it(client, path, [row["id"] for row in after])


def _amend_it(client: httpx.Client, published: str, holds: list[int]) -> None:
    """A hold that was removed comes back by an amendment of the published wall."""
    gym, _, scan = published.rpartition("/scans/")
    wall = _scan(client, published)["wall_id"]
    amendment = client.post(f"{gym}/walls/{wall}/amendments").json()
    assert amendment["amends_id"] == scan
    path = f"{gym}/scans/{amendment['id']}"
    log = f"{path}/editor/log"
    before = _scan(client, log)
    assert (before["version"], len(before["edits"]["edits"])) == ("1", 1)
    edits = {"version": 2, "edits": []}
    assert client.post(log, json={"version": "1", "edits": edits}).status_code == 200
    wait_for(lambda: _settled(_scan(client, f"{log}/state")))
    assert {row["id"] for row in _shown(client, path, "holds.json")["holds"]} > set(holds)
    draft = client.get(f"{path}/draft").json()
    body = {"revision": draft["revision"], "routes": []}
    assert client.post(f"{path}/publish", json=body).status_code == 200


def _settled(state: dict[str, Any]) -> dict[str, Any] | None:
    """Return the state of an editor that has written all edits and rests, else None."""
    return None if state["stale"] or state["running"] else state


def _shown(client: httpx.Client, path: str, name: str) -> dict[str, Any]:
    return _scan(client, f"{path}/files/{name}")
