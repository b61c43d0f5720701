"""The attack script: the tests' server refuses everything, and an open server is noticed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest
from gym.benchmarks.attack import Send, Target, attack, main, photo_names
from gym.tests.running import Process
from gym.tests.worlds import PASSWORD, Server, Somebody


@pytest.fixture
def target(server: Server) -> Target:
    people = server.persons("owner", "climber")

    def sending(who: Somebody) -> Send:
        def send(method: str, url: str, **more: Any) -> httpx.Response:
            headers = {**who.headers, **more.pop("headers", {})}
            return server.client().request(method, url, headers=headers, **more)

        return send

    return Target(sending(people["owner"]), sending(people["climber"]), sending(Somebody()))


def test_every_attack_is_refused(target: Target) -> None:
    findings = attack(target)
    assert len(findings) > 60
    assert [finding for finding in findings if not finding.is_held] == []


@pytest.mark.slow
def test_the_script_attacks_a_server_that_runs(tmp_path: Path, capsys: Any) -> None:
    made = Server(tmp_path)
    people = made.persons("owner", "climber")
    made.close()
    serving = Process(tmp_path, "serve", port="0", host="127.0.0.1", workers="0", new_gyms="anyone")
    try:
        owner, climber = (f"{people[who].email}:{PASSWORD}" for who in ("owner", "climber"))
        assert main([serving.first_line, "--owner", owner, "--climber", climber]) == 0
    finally:
        serving.stop()
    assert "0 not refused" in capsys.readouterr().out


def test_an_attack_that_succeeds_is_reported(target: Target) -> None:
    def accept(method: str, url: str, **more: Any) -> httpx.Response:
        return httpx.Response(201, json={"id": "1"})

    open_to_all = Target(accept, accept, accept)
    assert not any(finding.is_held for finding in photo_names(open_to_all))
