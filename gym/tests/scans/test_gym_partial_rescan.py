"""Photos of a part of a published wall: the rest stays as it is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from uuid import UUID, uuid4

import httpx
import msgspec
import pytest
from gym.tests.running import Process, announce, browser, send, wait_for
from gym.tests.worlds import Server, World, hold, make_world

from walltopo.pipeline.partial.colours import colours_of
from walltopo.pipeline.settings import load_settings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Manifest
from walltopo_gym.clock import now
from walltopo_gym.scans.artifacts import drop_joined
from walltopo_gym.scans.service import State
from walltopo_gym.scans.stages import rescan_settings

HOLDS = [hold(number, 0.3 * number, 1.0) for number in range(1, 9)]


def test_no_part_of_a_wall_without_a_published_version(server: Server) -> None:
    world = make_world(server)
    scan = world.scan(usable=3)
    path, setter = f"{world.path}/scans/{scan}", world.people["setter"]
    refused = server.ask("POST", f"{path}/start", setter, {"part": True})
    assert refused.status_code == 409
    assert refused.json()["code"] == "part-of-nothing"
    assert server.ask("GET", path, setter).json()["state"] == "uploading"
    started = server.ask("POST", f"{path}/start", setter, {"part": False})
    assert (started.status_code, started.json()["part"]) == (200, False)


def _begun(server: Server) -> tuple[World, UUID, str]:
    """Return a gym with a published wall, its version, and the path of a scan with three photos."""
    world = make_world(server)
    first = world.reviewed({1: [1, 2]}, HOLDS)
    assert world.publish(first, {"number": 1}).status_code == 200
    scans = f"{world.path}/walls/{world.wall.id}/scans"
    begun = server.ask("POST", scans, world.people["setter"]).json()
    for number in range(3):
        world.photo(UUID(begun["id"]), name=f"{number}.jpg", state="usable")
    return world, first, f"{world.path}/scans/{begun['id']}"


def test_a_part_is_of_the_version_that_is_published_when_it_starts(server: Server) -> None:
    world, first, path = _begun(server)
    setter = world.people["setter"]
    second = world.reviewed({1: [1, 2]}, HOLDS, reference_id=first)
    assert world.publish(second, {"number": 1}, revision=1).status_code == 200
    started = server.ask("POST", f"{path}/start", setter, {"part": True}).json()
    assert (started["part"], started["reference_id"]) == (True, str(second))


def test_a_part_may_exchange_one_colour(server: Server) -> None:
    world, _, path = _begun(server)
    setter = world.people["setter"]
    for body in (
        {"part": False, "colours": ["red"]},
        {"part": True, "colours": ["red,blue"]},
        {"part": True, "colours": [" "]},
    ):
        assert server.ask("POST", f"{path}/start", setter, body).status_code == 422
    body = {"part": True, "colours": ["red", "Grün „neu“"]}
    started = server.ask("POST", f"{path}/start", setter, body).json()
    assert (started["state"], started["colours"]) == ("queued", body["colours"])
    settings = load_settings(None, rescan_settings(Path("wall"), True, started["colours"])).sparse
    assert (settings.part, settings.reference) == (True, str(Path("wall").absolute()))
    assert colours_of(settings.part_colours) == ("red", "Grün „neu“")
    settings = load_settings(None, rescan_settings(Path("wall"), False, [])).sparse
    assert (settings.part, settings.part_colours) == (False, "")
    # Started again, it exchanges all colours.
    assert server.ask("POST", f"{path}/cancel", setter).status_code == 200
    started = server.ask("POST", f"{path}/start", setter, {"part": True}).json()
    assert started["colours"] == []


def test_the_review_says_what_one_colour_left(server: Server) -> None:
    world = make_world(server)
    first = world.reviewed({1: [1, 2], 2: [5, 6]}, HOLDS)
    assert world.publish(first, {"number": 1}, {"number": 2}).status_code == 200
    part = world.reviewed({1: [1, 2], 2: [5, 6]}, HOLDS, reference_id=first, part=True)
    joined = Joined(
        replaced_share=0.3,
        seam_mm=1.5,
        photos_kept=3,
        photos_new=4,
        stays=(5, 6, 7),
        same=(1,),
        gone=(3,),
        added=(2, 4),
        colours=("red",),
        missing=(5, 7),
        ignored=2,
    )
    _edit_manifest(server, part, joined)
    draft = server.ask("GET", f"{world.path}/scans/{part}/draft", world.people["setter"]).json()
    found = draft["joined"]
    assert (found["colours"], found["missing"], found["ignored"]) == (["red"], [5, 7], 2)
    assert {line["number"]: line["photographed"] for line in draft["lines"]} == {1: True, 2: False}


def test_the_review_says_what_was_not_photographed(server: Server) -> None:
    world = make_world(server)
    first = world.reviewed({1: [1, 2], 2: [5, 6]}, HOLDS)
    assert world.publish(first, {"number": 1}, {"number": 2}).status_code == 200
    part = world.reviewed({1: [1, 2], 2: [5, 6]}, HOLDS, reference_id=first, part=True)
    joined = Joined(
        replaced_share=0.3,
        seam_mm=1.5,
        photos_kept=3,
        photos_new=4,
        stays=(5, 6, 7, 8),
        same=(1,),
        gone=(3,),
        added=(2, 4),
        seam=(((1.2, 0.0, 0.0), (1.3, 0.1, 2.5)),),
    )
    _edit_manifest(server, part, joined)
    path = f"{world.path}/scans/{part}/draft"
    draft = server.ask("GET", path, world.people["setter"]).json()
    assert {line["number"]: line["photographed"] for line in draft["lines"]} == {1: True, 2: False}
    assert draft["joined"] == {
        "replaced_share": 0.3,
        "seam_mm": 1.5,
        "seam": [[[1.2, 0.0, 0.0], [1.3, 0.1, 2.5]]],
        "stays": 4,
        "same": 1,
        "gone": 1,
        "added": 2,
        "colours": [],
        "missing": [],
        "ignored": 0,
    }
    assert draft["warnings"] == []
    # Another version is published meanwhile: what it changed elsewhere is not in this one.
    other = world.reviewed({1: [1, 2]}, HOLDS, reference_id=first)
    assert world.publish(other, {"number": 1}, revision=1).status_code == 200
    draft = server.ask("GET", path, world.people["setter"]).json()
    assert "Another version was published" in draft["warnings"][0]


def test_a_part_that_starts_again_starts_from_its_photos(server: Server) -> None:
    world = make_world(server)
    store = server.services.store
    whole, part = (world.reviewed({1: [1, 2]}, HOLDS, part=part) for part in (False, True))
    joined = _joined(stays=(5,), same=(1,), gone=(3,), added=(2,))
    _edit_manifest(server, part, joined)
    assert not drop_joined(store, whole)
    assert drop_joined(store, part)
    assert not drop_joined(store, part)
    assert store.keys(f"scans/{whole}/")
    assert not store.keys(f"scans/{part}/")


def test_an_amendment_of_a_part_is_of_the_whole_wall(server: Server) -> None:
    world = make_world(server)
    amendment = world.reviewed({1: [1, 2]}, HOLDS)
    _edit_manifest(server, amendment, _joined(stays=(1, 2)))
    path = f"{world.path}/scans/{amendment}/draft"
    draft = server.ask("GET", path, world.people["setter"]).json()
    assert draft["joined"] is None
    assert [line["photographed"] for line in draft["lines"]] == [True]


def _joined(**holds: tuple[int, ...]) -> Joined:
    lists = {name: holds.get(name, ()) for name in ("stays", "same", "gone", "added")}
    figures = {"replaced_share": 0.3, "seam_mm": 1.5, "photos_kept": 3, "photos_new": 4}
    return msgspec.convert(figures | lists, Joined)


def _edit_manifest(server: Server, scan: Any, joined: Joined) -> None:
    key, folder = f"scans/{scan}/scan.json", server.settings.data / "for-a-test"
    path = folder / "scan.json"
    server.services.store.fetch(key, path)
    manifest = Manifest.load(path)
    manifest.joined = joined
    manifest.save(path)
    server.services.store.put(key, path)


@pytest.mark.slow
def test_a_reset_day_although_the_server_is_killed(
    tmp_path: Path, tiny_photos: Path, tiny_scan: Path
) -> None:
    world = make_world(Server(tmp_path))
    whole = world.finished(tiny_scan)
    routes = ScanFolder.routes.load(ScanFolder(tiny_scan)).routes
    entries = [{"number": route.id, "name": f"Moon {route.id}"} for route in routes]
    assert world.publish(whole, *entries).status_code == 200
    before = {route["name"]: route["id"] for route in world.published()["routes"]}
    added = _routes_by_csv(world)
    world.server.close()
    # The surface of the published wall, so that holds are where they were.
    (tmp_path / "quick.toml").write_text("[sparse]\nthreads = 1\n[texture]\nsize = 512\n")
    settings = {"scan_settings": str(tmp_path / "quick.toml")}
    cookie = world.people["setter"].headers["cookie"].partition("=")[2]
    process = Process(tmp_path, "serve", "--port", "0", **settings)
    try:
        client = browser(process.first_line, cookie)
        path = _send_part(client, world.path, str(world.wall.id), tiny_photos)
        manifest = tmp_path / "files" / path.partition("/gyms/")[2].partition("/")[2] / "scan.json"
        wait_for(
            lambda: manifest.is_file() and "detect" in json.loads(manifest.read_text())["stages"]
        )
        process.kill()
        process = Process(tmp_path, "serve", "--port", "0", **settings)
        client = browser(process.first_line, cookie)
        ended = wait_for(
            lambda: (facts := client.get(path).json())["state"] in ("review", "failed") and facts
        )
        assert ended["state"] == State.REVIEW, ended
        draft = client.get(f"{path}/draft").json()
        assert draft["joined"]["replaced_share"] > 0.1
        assert draft["joined"]["seam"]
        assert draft["joined"]["colours"] == ["blue"]
        assert (draft["joined"]["missing"], draft["joined"]["ignored"]) == ([], 0)
        assert draft["joined"]["same"] > 0
        assert draft["joined"]["gone"] + draft["joined"]["added"] == 0
        assert draft["warnings"] == []
        # The same wall on the same photos: each route is the one that it was.
        same = {line["route_id"] for line in draft["lines"] if line["fate"] in ("kept", "changed")}
        assert same == set(before.values())
        # The routes of the table are offered; one of them is identified, the other one waits.
        assert {route["id"] for route in draft["unplaced"]} == set(added.values())
        rows = [
            {"number": line["number"], "route_id": line["route_id"]}
            for line in draft["lines"]
            if line["number"] is not None
        ]
        rows[0]["route_id"] = added["Sun"]
        body = {"revision": draft["revision"], "routes": rows}
        assert client.post(f"{path}/publish", json=body).status_code == 200
        shown = client.get(f"{world.path}/walls/{world.wall.id}/routes").json()
        numbers = {route["name"]: route["number"] for route in shown}
        assert (numbers["Sun"], numbers["Star"]) == (rows[0]["number"], None)
        tallies = client.get(f"{world.path}/walls/{world.wall.id}/tallies").json()
        assert {one["route_id"]: one["climbers"] for one in tallies}[added["Sun"]] == 1
    finally:
        process.stop()


def _routes_by_csv(world: World) -> dict[str, str]:
    """Add two routes that no scan shows yet, and a tick of one; return their ids by name."""
    path = f"{world.path}/walls/{world.wall.id}/routes"
    body = {"id": str(uuid4()), "csv": "name,colour\nSun,pink\nStar,blue", "really": True}
    setter, member = world.people["setter"], world.people["member"]
    assert world.server.ask("POST", f"{path}/import", setter, body).json()["added"] == 2
    routes = world.server.ask("GET", path, member).json()
    added = {route["name"]: route["id"] for route in routes if route["name"] in ("Sun", "Star")}
    tick = {"route_id": added["Sun"], "kind": "top", "climbed_at": now().isoformat()}
    assert world.server.ask("PUT", f"{world.path}/ascents/{uuid4()}", member, tick).is_success
    return added


def _send_part(client: httpx.Client, gym: str, wall: str, photos: Path) -> str:
    """Send half of a wall's photos, and start for one colour; return the scan's path."""
    begun = client.post(f"{gym}/walls/{wall}/scans").json()
    path = f"{gym}/scans/{begun['id']}"
    for file in sorted(photos.iterdir())[:5]:
        content = file.read_bytes()
        place = announce(client, f"{path}/photos", file.name, content).headers["location"]
        assert send(client, place, content).status_code == 204
    wait_for(lambda: {p["state"] for p in client.get(f"{path}/photos").json()} == {"usable"})
    answer = client.post(f"{path}/start", json={"part": True, "colours": ["blue"]})
    assert (answer.status_code, answer.json()["part"]) == (200, True)
    return path
