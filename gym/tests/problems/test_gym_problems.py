"""Climbers' problems: stored once, followed over versions, shared, moderated, promoted."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from datetime import timedelta
from io import BytesIO
from typing import Any
from uuid import UUID, uuid4

import msgspec
import pytest
from gym.tests.worlds import World, hold, make_world
from sqlalchemy import select

from walltopo_gym.accounts import limits
from walltopo_gym.accounts.limits import Limit
from walltopo_gym.accounts.models import AuditEntry
from walltopo_gym.clock import now
from walltopo_gym.errors import UnavailableError
from walltopo_gym.grading.placing import Placing
from walltopo_gym.gyms.models import Ban, GradeSystem
from walltopo_gym.messages import english
from walltopo_gym.operating.own_data import delete_account
from walltopo_gym.problems import estimate
from walltopo_gym.problems.models import Problem
from walltopo_gym.problems.service import Use, UsedHold
from walltopo_gym.publishing.version_holds import version_holds

pytestmark = pytest.mark.both_databases("search and paging in SQL")

LADDER = [hold(n, 0.15 * (n % 2), 0.4 + 0.35 * n) for n in range(1, 9)]
HOLDS: list[dict[str, Any]] = [
    {"hold": 2, "use": "start"},
    {"hold": 1, "use": "foot"},
    {"hold": 4, "use": "hand"},
    {"hold": 6, "use": "hand"},
    {"hold": 8, "use": "top"},
]


@pytest.fixture
def scan(world: World) -> UUID:
    """A published version: a ladder of eight holds, one of them on a route."""
    made = world.reviewed({1: [1]}, LADDER)
    assert world.publish(made, {"number": 1, "name": "Moon"}).is_success
    return made


def body(world: World, scan: UUID, **facts: Any) -> dict[str, Any]:
    plain = {"wall_id": str(world.wall.id), "scan_id": str(scan), "holds": HOLDS, "name": "Mine"}
    return plain | {"share": "gym"} | facts


def put(world: World, who: str, scan: UUID, key: object = None, **facts: Any) -> Any:
    path = f"{world.path}/problems/{key or uuid4()}"
    return world.server.ask("PUT", path, world.people[who], body(world, scan, **facts))


def read(world: World, who: str, key: object) -> Any:
    return world.server.ask("GET", f"{world.path}/problems/{key}", world.people[who])


def names(world: World, who: str, query: str = "") -> list[str]:
    path = f"{world.path}/walls/{world.wall.id}/problems{query}"
    answer = world.server.ask("GET", path, world.people[who])
    assert answer.status_code == 200, answer.text
    return [row["name"] for row in answer.json()["items"]]


def test_a_problem_is_stored_once_and_changed_by_its_author(world: World, scan: UUID) -> None:
    key = uuid4()
    first = put(world, "member", scan, key)
    assert first.status_code == 201, first.text
    assert (first.json()["holds"], first.json()["gone"]) == (HOLDS, 0)
    assert put(world, "member", scan, key, name="Yours", matching=False).status_code == 200
    assert put(world, "judge", scan, key).status_code == 409
    found = read(world, "judge", key).json()
    assert (found["name"], found["matching"], found["author"]) == ("Yours", False, "member")
    assert names(world, "judge") == ["Yours"]
    assert names(world, "judge", "?mine=true") == []


def test_a_late_copy_of_an_older_edit_changes_nothing(world: World, scan: UUID) -> None:
    key, device = uuid4(), str(uuid4())
    newer = {"device": device, "number": 2, "age_s": 0}
    older = {"device": device, "number": 1, "age_s": 60}
    assert put(world, "member", scan, key, name="New", edit=newer).is_success
    assert put(world, "member", scan, key, name="Old", edit=older).json()["name"] == "New"


def test_a_deleted_problem_is_not_revived_by_a_late_copy(world: World, scan: UUID) -> None:
    key = uuid4()
    put(world, "member", scan, key)
    for _ in range(2):
        gone = world.server.ask("DELETE", f"/me/problems/{key}", world.people["member"])
        assert gone.status_code == 204
    assert (
        world.server.ask("DELETE", f"/me/problems/{key}", world.people["judge"]).status_code == 404
    )
    assert put(world, "member", scan, key).is_success
    assert read(world, "member", key).status_code == 404
    assert names(world, "member") == []


@pytest.mark.parametrize(
    ("holds", "key"),
    [
        ([*HOLDS, {"hold": 8, "use": "hand"}], "problem-hold-twice"),
        (HOLDS[1:], "problem-start-top"),
        (HOLDS[:-1], "problem-start-top"),
        ([*HOLDS, {"hold": 99, "use": "hand"}], "hold-unknown"),
    ],
)
def test_holds_that_make_no_problem(world: World, scan: UUID, holds: Any, key: str) -> None:
    refused = put(world, "member", scan, holds=holds)
    assert (refused.status_code, refused.json()["title"]) == (422, english(key, {}))


def test_only_versions_that_this_wall_published(world: World, scan: UUID) -> None:
    draft = world.reviewed({1: [1]}, LADDER)
    assert put(world, "member", draft).status_code == 422


def test_who_sees_a_problem(world: World, scan: UUID) -> None:
    keys = {share: uuid4() for share in ("private", "link", "gym")}
    for share, key in keys.items():
        assert put(world, "member", scan, key, name=share, share=share).is_success
    assert sorted(names(world, "member")) == ["gym", "link", "private"]
    assert names(world, "judge") == names(world, "setter") == ["gym"]
    seen = {share: read(world, "judge", key).status_code for share, key in keys.items()}
    assert seen == {"private": 404, "link": 200, "gym": 200}
    with world.server.database.writing() as session:
        session.merge(world.gym).visibility = "public"
    for who, status in (("stranger", 200), ("nobody", 200)):
        linked = read(world, who, keys["link"])
        assert (linked.status_code, linked.json()["author"]) == (status, "")
        assert read(world, who, keys["gym"]).status_code == 404


def test_after_a_reset_it_says_which_holds_are_gone(world: World, scan: UUID) -> None:
    """Hold 6 was taken off; the others are numbered anew."""
    key = uuid4()
    put(world, "member", scan, key)
    stayed = [one for one in LADDER if one.id != 6]
    anew = [hold(50 + n, one.position[0], one.position[2]) for n, one in enumerate(stayed)]
    later = world.reviewed({1: [50]}, anew)
    assert world.publish(later, {"number": 1}, revision=1).is_success
    found = read(world, "member", key).json()
    now_at = {one.id: 50 + n for n, one in enumerate(stayed)}
    kept = [
        {"hold": now_at[each["hold"]], "use": each["use"]} for each in HOLDS if each["hold"] != 6
    ]
    assert (found["holds"], found["gone"]) == (kept, 1)
    remix = put(world, "judge", later, holds=kept, remix_of=str(key), name="Again")
    assert (remix.status_code, remix.json()["gone"], remix.json()["remix_of"]) == (201, 0, str(key))


def test_problems_are_found_by_a_hold_over_all_versions(world: World, scan: UUID) -> None:
    few = [HOLDS[0], HOLDS[-1]]
    old = uuid4()
    assert put(world, "member", scan, old, name="Old").is_success
    assert put(world, "member", scan, name="Few", holds=few).is_success
    assert put(world, "member", scan, name="Own", share="private").is_success
    assert names(world, "judge", "?hold=6") == ["Old"]
    assert names(world, "judge", "?hold=8") == ["Few", "Old"]
    assert names(world, "member", "?hold=6&mine=true") == ["Own", "Old"]
    assert names(world, "judge", "?hold=7") == []
    # Hold 6 is hold 106 of the next version.
    others = [msgspec.structs.replace(one, id=one.id + 100) for one in LADDER]
    after = world.reviewed({1: [101]}, others)
    assert world.publish(after, {"number": 1}, revision=1).is_success
    assert names(world, "judge", "?hold=106") == ["Old"]
    assert names(world, "judge", "?hold=6") == []
    assert put(world, "member", scan, old, name="Old", holds=few).is_success
    assert names(world, "judge", "?hold=106") == []
    path = f"/me/problems/{old}"
    assert world.server.ask("DELETE", path, world.people["member"]).is_success
    assert names(world, "judge", "?hold=108") == ["Few"]


def test_a_remix_is_of_a_problem_that_its_author_may_see(world: World, scan: UUID) -> None:
    other = make_world(world.server, world.people, visibility="public")
    there = other.reviewed({1: [1]}, LADDER)
    assert other.publish(there, {"number": 1, "name": "Sun"}).is_success
    elsewhere, private, hidden, deleted, own = (uuid4() for _ in range(5))
    assert put(other, "member", there, elsewhere).status_code == 201
    assert put(world, "member", scan, private, share="private").status_code == 201
    assert put(world, "member", scan, hidden).status_code == 201
    path = f"{world.path}/problems/{hidden}/hidden"
    assert world.server.ask("PUT", path, world.people["setter"]).status_code == 204
    assert put(world, "member", scan, deleted).status_code == 201
    for base in (elsewhere, private, hidden, uuid4(), own):
        answer = put(world, "judge", scan, own, remix_of=str(base))
        assert (answer.status_code, answer.json().get("code")) == (422, "problem-remix-unknown")
    # One's own, and what setters see.
    assert put(world, "member", scan, remix_of=str(private)).status_code == 201
    assert put(world, "setter", scan, remix_of=str(hidden)).status_code == 201
    # A problem that was deleted while its remix waited for reception, and a remix that is changed.
    path = f"/me/problems/{deleted}"
    assert world.server.ask("DELETE", path, world.people["member"]).status_code == 204
    assert put(world, "judge", scan, own, remix_of=str(deleted)).status_code == 201
    assert put(world, "judge", scan, own, remix_of=str(own)).status_code == 422
    assert put(world, "member", scan, private, share="link", remix_of=str(deleted)).is_success
    assert put(world, "judge", scan, own, remix_of=str(private), name="By link").is_success
    assert put(world, "member", scan, private, share="private").is_success
    assert put(world, "judge", scan, own, remix_of=str(private), name="Mine").is_success


def test_a_problems_grade_system_is_the_gyms(world: World, scan: UUID) -> None:
    other = make_world(world.server)
    with world.server.database.writing() as session:
        system = GradeSystem(gym_id=other.gym.id, name="V", kind="custom", grades=[])
        session.add(system)
    for grade in ("", "V4"):
        answer = put(world, "member", scan, grade_system_id=str(system.id), grade=grade)
        assert (answer.status_code, answer.json()["code"]) == (422, "not-there-grades")


def test_who_climbed_it(world: World, scan: UUID) -> None:
    key, device = uuid4(), str(uuid4())
    put(world, "member", scan, key)
    path = f"{world.path}/problems/{key}/climbed"
    day = f"{now() - timedelta(hours=3):%Y-%m-%dT%H:%M:%SZ}"

    def say(who: str, at: str | None, number: int) -> None:
        edit = {"device": device, "number": number, "age_s": 0}
        words = {"climbed_at": at, "edit": edit}
        assert world.server.ask("PUT", path, world.people[who], words).status_code == 204

    say("member", day, 1)
    say("judge", day, 2)
    found = read(world, "judge", key).json()
    assert (found["climbers"], found["climbed_at"]) == (2, day)
    say("judge", None, 4)
    say("judge", day, 3)  # a late copy
    assert read(world, "judge", key).json()["climbers"] == 1


def test_a_reported_problem_is_hidden_or_kept(world: World, scan: UUID) -> None:
    key = uuid4()
    put(world, "member", scan, key, note="Rubbish")
    report = f"{world.path}/problems/{key}/report"
    for _ in range(2):
        assert world.server.ask("PUT", report, world.people["judge"], {}).status_code == 204

    def reports() -> Any:
        path = f"{world.path}/problem-reports"
        return world.server.ask("GET", path, world.people["setter"]).json()["items"]

    [one] = reports()
    assert one["text"] == "Mine\nRubbish"
    hidden = f"{world.path}/problems/{key}/hidden"
    for method, seen in (("PUT", []), ("DELETE", ["Mine"])):
        assert world.server.ask(method, hidden, world.people["setter"]).status_code == 204
        assert names(world, "judge") == seen
        assert names(world, "member") == ["Mine"]
        assert reports() == []
    with world.server.database.reading() as session:
        mine = select(AuditEntry.action).where(AuditEntry.gym_id == world.gym.id)
        log = [action for action in session.scalars(mine) if action.startswith("problem.")]
    assert sorted(log) == ["problem.hide", "problem.show"]


def test_problems_of_banned_people_are_not_listed(world: World, scan: UUID) -> None:
    put(world, "member", scan)
    with world.server.database.writing() as session:
        session.add(Ban(gym_id=world.gym.id, person_id=world.people["member"].id, reason=""))
    assert names(world, "judge") == []
    assert names(world, "setter") == ["Mine"]
    assert put(world, "member", scan).status_code == 403


def test_a_setter_makes_a_route_of_it_once(world: World, scan: UUID) -> None:
    with world.server.database.reading() as session:
        of_gym = select(GradeSystem).where(GradeSystem.gym_id == world.gym.id)
        system = session.scalars(of_gym.order_by(GradeSystem.name)).first()
        assert system is not None
        graded = {"grade_system_id": str(system.id), "grade": system.grades[3]["label"]}
    key = uuid4()
    assert put(world, "member", scan, key, **graded).is_success
    path = f"{world.path}/problems/{key}/promote"
    made = [world.server.ask("POST", path, world.people["setter"]) for _ in range(2)]
    assert [answer.status_code for answer in made] == [200, 200], made[0].text
    route = world.server.ask(
        "GET", f"{world.path}/routes/{made[0].json()['route_id']}", world.people["member"]
    ).json()
    assert (route["name"], route["setter"], route["grade"]) == ("Mine", "", graded["grade"])
    private = uuid4()
    put(world, "setter", scan, private, share="private")
    path = f"{world.path}/problems/{private}/promote"
    assert world.server.ask("POST", path, world.people["setter"]).status_code == 409


def test_the_model_gives_a_grade_and_who_reaches_the_holds(world: World, scan: UUID) -> None:
    Placing(world.server.database, world.server.services.store).place(str(scan))
    path = f"{world.path}/walls/{world.wall.id}/problem-estimate"

    def ask(holds: Any) -> Any:
        words = {"scan_id": str(scan), "holds": holds}
        answer = world.server.ask("POST", path, world.people["member"], words)
        assert answer.status_code == 200, answer.text
        return answer.json()

    ladder = [
        {"hold": n, "use": "start" if n == 2 else "top" if n == 8 else "hand"} for n in range(1, 9)
    ]
    found = ask(ladder)
    assert found["grades"] is not None
    assert {row["height_m"] for row in found["heights"] if row["reached"]} >= {1.65, 1.80}
    apart = [{"hold": 1, "use": "start"}, {"hold": 8, "use": "top"}]
    far = ask(apart)
    assert far["grades"] is None
    assert not any(row["reached"] for row in far["heights"])


def test_a_maker_sees_moves_and_holds_that_open_the_problem(world: World, scan: UUID) -> None:
    def ask(what: str, *wanted: tuple[int, str]) -> Any:
        path = f"{world.path}/walls/{world.wall.id}/problem-{what}"
        holds = [{"hold": hold, "use": use} for hold, use in wanted]
        words = {"scan_id": str(scan), "holds": holds}
        answer = world.server.ask("POST", path, world.people["member"], words)
        assert answer.status_code == 200, answer.text
        return answer.json()

    whole = [(n, "start" if n == 2 else "top" if n == 8 else "hand") for n in range(1, 9)]
    moves = ask("moves", *whole)
    assert [body["climber"] for body in moves["climbers"]] == ["child", "short", "adult", "tall"]
    adult = moves["climbers"][2]
    assert adult["reached"]
    assert adult["moves"][0]["limb"] == "start"
    assert {hold for move in adult["moves"] for hold in move["holds"]} <= {0, *range(1, 9)}
    assert ask("openings", *whole) == []  # everybody reaches the top
    # Without three of its rungs it is long; with one of them shorter climbers reach the top.
    gapped = [each for each in whole if each[0] not in (4, 5, 6)]
    found = ask("openings", *gapped)
    assert found[0]["hold"] in (4, 5, 6)

    def lowest(*wanted: tuple[int, str]) -> float:
        heights = ask("estimate", *wanted)["heights"]
        return min((row["height_m"] for row in heights if row["reached"]), default=9.0)

    with_it = lowest(*gapped, (found[0]["hold"], found[0]["use"]))
    assert with_it == found[0]["height_m"] < lowest(*gapped)


KERNELS = """
import gc
from numba.core.dispatcher import Dispatcher
from walltopo_gym.problems.estimate_worker import _FIRST, EstimateRequest, estimate_problem
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

def compiled():
    found = (one for one in gc.get_objects() if isinstance(one, Dispatcher))
    return {(one.py_func.__qualname__, str(way)) for one in found for way in one.signatures}

assert estimate_problem(_FIRST).difficulty is not None
before = compiled()
for step in (0.3, 1.0):
    holds = [
        Hold(id=n, kind="hold", type="jug", position=(0.2 * n, 0.1, n * step), size=0.1)
        for n in range(1, 12)
    ]
    for start in ((1,), (1, 2)):
        route = Route(id=1, holds=(1, 2, 3, 5, 7, 11), start=start, top=(11,), footholds=(4, 6))
        estimate_problem(EstimateRequest(route, holds, 0.5))
print(len(before), compiled() - before)
"""


def test_no_request_waits_for_the_compiler() -> None:
    found = subprocess.run(
        [sys.executable, "-c", KERNELS], capture_output=True, text=True, check=False
    )
    count, _, more = found.stdout.strip().partition(" ")
    assert int(count) >= 2, found.stderr
    assert more == "set()"


def test_an_estimate_that_takes_too_long_is_ended_and_the_next_one_is_made(
    world: World, scan: UUID, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = f"{world.path}/walls/{world.wall.id}/problem-estimate"

    def ask() -> Any:
        words = {"scan_id": str(scan), "holds": HOLDS}
        return world.server.ask("POST", path, world.people["member"], words)

    assert ask().status_code == 200
    child = world.server.services.get(estimate.Estimator)._child
    assert child is not None
    os.kill(child.pid, signal.SIGSTOP)  # it never answers
    with monkeypatch.context() as patch:
        patch.setattr(estimate, "_LIMIT_S", 0.1)
        slow = ask()
    assert (slow.status_code, slow.json()["code"]) == (422, "estimate-too-long")
    assert ask().status_code == 200


def test_an_estimator_outlives_its_process_and_ends_for_good(world: World, scan: UUID) -> None:
    version = version_holds(world.server.services.store, scan)
    used = [UsedHold(row["hold"], Use(row["use"])) for row in HOLDS]
    estimator = estimate.Estimator()
    first = estimator.estimate(used, version)
    assert estimator._child is not None
    estimator._child.kill()
    assert estimator.estimate(used, version) == first
    estimator.close()
    with pytest.raises(UnavailableError):
        estimator.estimate(used, version)


class _Broken:
    """A process that answers a part of a line."""

    def __init__(self) -> None:
        self.output = BytesIO(b'{"place": 1')
        self.is_running = True

    def send(self, message: bytes) -> None: ...

    def kill(self) -> None:
        self.is_running = False


def test_a_part_of_an_estimate_is_none() -> None:
    broken = _Broken()
    assert estimate._exchange_message(broken, b"", 600) == (b"", False)  # type: ignore[arg-type]
    assert not broken.is_running


def test_a_limit_of_a_day(world: World, scan: UUID, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "_PROBLEMS", Limit("problem", 2, 86400))
    assert [put(world, "member", scan).status_code for _ in range(3)] == [201, 201, 429]


def test_ones_own_data_and_the_end_of_an_account(world: World, scan: UUID) -> None:
    key = uuid4()
    put(world, "member", scan, key)
    data = world.server.ask("GET", "/me/data", world.people["member"]).json()
    assert [row["id"] for row in data["problems"]] == [str(key)]
    member = world.people["member"].id
    assert member is not None
    with world.server.database.writing() as session:
        delete_account(session, member)
    with world.server.database.reading() as session:
        assert session.get(Problem, key) is None
