"""A gym's own network: only by consent, trained at night, used only where it is better."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from gym.tests.worlds import Server, World, make_world

from walltopo_gym.operating.purge import _is_named
from walltopo_gym.scans import commands, own_network
from walltopo_gym.scans.models import Scan, ScanEdits
from walltopo_gym.scans.own_network import OwnNetwork, OwnNetworks, network_of, switch_training
from walltopo_gym.scans.running import WorkerStopsError
from walltopo_gym.scans.service import State
from walltopo_gym.scans.stages import ScanSteps

RESULT = {
    "photos": 8,
    "objects": 90,
    "held_out": 3,
    "before": {"masks": 0.6, "mean": 0.5},
    "after": {"masks": 0.7, "mean": 0.6},
    "better": True,
}


@pytest.fixture
def corrected(world: World) -> World:
    """A gym that wants a network, and has a published wall with a correction."""
    scan = world.scan(state=State.PUBLISHED)
    with world.server.database.writing() as session:
        session.add(ScanEdits(scan_id=scan, revision=2, shown=2, log={}))
        switch_training(session, world.gym.id, True)
    return world


def row_of(world: World) -> OwnNetwork:
    with world.server.database.reading() as session:
        return session.get_one(OwnNetwork, world.gym.id)


def networks(world: World) -> OwnNetworks:
    return OwnNetworks(world.server.settings, world.server.database, world.server.services.store)


def trainer(monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Let a script take the place of `walltopo train gym`; `out` is the folder it writes into."""
    head = (
        "import json, pathlib, sys, time\nout = pathlib.Path(sys.argv[sys.argv.index('-o') + 1])\n"
    )

    def command(module: str, *words: str) -> list[str]:
        assert (module, words[:2]) == ("walltopo_gym.scans.low_priority", ("train", "gym"))
        return [sys.executable, "-c", head + script, *words]

    monkeypatch.setattr(commands, "python_module", command)


def writes(result: dict[str, Any]) -> str:
    return (
        "out.mkdir(); (out / 'holds.onnx').write_bytes(b'network')\n"
        f"(out / 'own.json').write_text({json.dumps(result)!r})"
    )


def test_a_training_is_queued_at_night_once_and_for_new_corrections(
    corrected: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    queued: list[str] = []
    monkeypatch.setattr(
        own_network, "enqueue", lambda session, job, gym_id, **words: queued.append(gym_id)
    )
    ours = str(corrected.gym.id)
    for hour, expected in ((12, 0), (2, 1)):
        monkeypatch.setattr(
            own_network, "now", lambda hour=hour: datetime(2026, 11, 26, hour, 23, tzinfo=UTC)
        )
        networks(corrected).queue_due()
        assert queued.count(ours) == expected
    with corrected.server.database.writing() as session:
        row = session.get_one(OwnNetwork, corrected.gym.id)
        row.basis = own_network._training_scans(session, corrected.gym.id)
    networks(corrected).queue_due()
    assert queued.count(ours) == 1, "these corrections were trained on"
    with corrected.server.database.writing() as session:
        switch_training(session, corrected.gym.id, False)
        session.get_one(OwnNetwork, corrected.gym.id).basis = []
    networks(corrected).queue_due()
    assert queued.count(ours) == 1, "the owner does not want one"


def test_a_better_network_finds_the_holds_of_the_next_scan(
    corrected: World, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    trainer(monkeypatch, writes(RESULT))
    networks(corrected).train(str(corrected.gym.id))
    row = row_of(corrected)
    assert (row.result, row.error, row.trained_at is not None) == (RESULT, "", True)
    server = corrected.server
    assert server.services.store.read(row.key) == b"network"
    assert _is_named(server.settings, server.database, row.key)
    steps = ScanSteps(server.settings, server.database, server.services.store, tmp_path)
    scan = corrected.scan()
    words = steps._prepare(scan).settings
    setting = next(word for word in words if word.startswith("detect.model="))
    assert Path(json.loads(setting.partition("=")[2])).read_bytes() == b"network"
    shown = server.ask("GET", f"{corrected.path}/scans/{scan}", corrected.people["setter"]).json()
    assert shown["network"] == RESULT
    with server.database.writing() as session:
        switch_training(session, corrected.gym.id, False)
    assert not [word for word in steps._prepare(scan).settings if "detect.model" in word]
    assert not _is_named(server.settings, server.database, row.key), "a purge deletes it"
    with server.database.reading() as session:
        assert session.get_one(Scan, scan).network is None


def test_a_network_that_is_not_better_is_not_used(
    corrected: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer(monkeypatch, writes({**RESULT, "better": False}))
    networks(corrected).train(str(corrected.gym.id))
    row = row_of(corrected)
    assert row.result is not None
    assert (row.key, row.result["better"]) == ("", False)
    with corrected.server.database.reading() as session:
        assert network_of(session, corrected.gym.id) is None


def test_why_a_training_failed_is_shown_to_the_owner(
    corrected: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer(
        monkeypatch, "print('reading'); print('error: /srv/x/mesh.ply: no such file'); sys.exit(3)"
    )
    networks(corrected).train(str(corrected.gym.id))
    answer = corrected.server.ask("GET", f"{corrected.path}/own-network", corrected.people["owner"])
    assert answer.json()["error"] == "mesh.ply: no such file"
    assert row_of(corrected).basis, "the same corrections are not tried every night"


def test_a_worker_that_stops_ends_the_training(
    corrected: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer(monkeypatch, "time.sleep(3600)")
    ours = networks(corrected)
    ours.stopping.set()
    with pytest.raises(WorkerStopsError):
        ours.train(str(corrected.gym.id))
    assert row_of(corrected).basis == []


def test_the_owner_turns_it_on_where_the_server_offers_it(world: World) -> None:
    path, owner = f"{world.path}/own-network", world.people["owner"]
    assert world.server.ask("GET", path, owner).json()["offered"] is False
    refused = world.server.ask("PUT", path, owner, {"wanted": True})
    assert (refused.status_code, refused.json()["code"]) == (409, "own-networks-off")


def test_an_owner_turns_it_on_and_off(tmp_path: Path) -> None:
    world = make_world(Server(tmp_path, own_networks=True))
    path, owner = f"{world.path}/own-network", world.people["owner"]
    on = world.server.ask("PUT", path, owner, {"wanted": True}).json()
    assert (on["offered"], on["wanted"], on["result"]) == (True, True, None)
    with world.server.database.writing() as session:
        session.get_one(OwnNetwork, world.gym.id).key = "networks/ab"
    off = world.server.ask("PUT", path, owner, {"wanted": False}).json()
    assert (off["wanted"], row_of(world).key) == (False, "")
    world.server.close()
