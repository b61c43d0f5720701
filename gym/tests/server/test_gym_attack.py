"""The attack script: the tests' server refuses everything, and an open server is noticed."""

from __future__ import annotations

from typing import Any

import httpx
import pytest
from gym.benchmarks.attack import Send, Target, attack, photo_names
from gym.tests.worlds import Server, Somebody


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


def test_an_attack_that_succeeds_is_reported(target: Target) -> None:
    def accept(method: str, url: str, **more: Any) -> httpx.Response:
        return httpx.Response(201, json={"id": "1"})

    open_to_all = Target(accept, accept, accept)
    assert not any(finding.is_held for finding in photo_names(open_to_all))
