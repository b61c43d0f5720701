"""Attack a running server with requests that once broke it; exit code 1 if one succeeds.

    python -m gym.benchmarks.attack http://localhost:8000 --owner MAIL:PASSWORD --climber MAIL:PASSWORD

The owner's account makes a gym of its own on the server and closes it at the end; the climber's is
an ordinary account. Attacks that need the server's disk or clock (permissions of files,
`gym backup`, late results) are in `gym/tests` alone.
"""

from __future__ import annotations

import argparse
import base64
import secrets
import struct
import sys
import zlib
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any
from uuid import uuid4

import httpx

API = "/api/v1"
FORBIDDEN = (401, 403, 404)
_GUESSES = 10  # of one account from one network in 15 minutes
_AT_ONCE = 20


# Sends one request of a person: method, address, and what httpx takes besides.
Send = Callable[..., httpx.Response]


@dataclass(frozen=True)
class Finding:
    """One request and whether the server refused it as it must.

    Parameters
    ----------
    attack : what was tried; answer : status and begin of the answer.
    """

    attack: str
    is_held: bool
    answer: str


@dataclass
class Target:
    """A gym on the server, and two people: its owner, and a climber without a role.

    Parameters
    ----------
    gym : its address name; owner, climber, nobody : what sends their requests.
    """

    owner: Send
    climber: Send
    nobody: Send
    gym: str = field(default_factory=lambda: f"attack-{secrets.token_hex(4)}")

    @property
    def path(self) -> str:
        """The gym's part of the API."""
        return f"{API}/gyms/{self.gym}"

    def made(self, path: str, body: object = None) -> dict[str, Any]:
        """Make something below the gym.

        Raises
        ------
        RuntimeError : the server refuses.
        """
        answer = self.owner("POST", self.path + path, json=body)
        if not answer.is_success:
            raise RuntimeError(f"{path}: {answer.status_code} {answer.text[:200]}")
        found: dict[str, Any] = answer.json()
        return found


def _finding(attack: str, answer: httpx.Response, *allowed: int) -> Finding:
    """Held: refused with one of the allowed codes, or with any of 4xx where none is given."""
    held = answer.status_code in allowed if allowed else 400 <= answer.status_code < 500
    return Finding(attack, held, f"{answer.status_code} {answer.text[:80]}")


def photo_names(target: Target) -> Iterator[Finding]:
    """Announce photos whose kept name is empty, leads out or is no photo; and one of 10 TB."""
    wall = target.made("/walls", {"name": "Slab"})["id"]
    scan = target.made(f"/walls/{wall}/scans")["id"]
    names = ("a.jpg/", "a.jpg/.", "..", "../../a.jpg/..", ".jpg/", "a.jpg\x00", "a.exe", "")
    for name, size in [*((name, 10) for name in names), ("a.jpg", 10**13), ("a.jpg", -1)]:
        headers = {
            "tus-resumable": "1.0.0",
            "upload-length": str(size),
            "upload-metadata": f"filename {base64.b64encode(name.encode()).decode()}".rstrip(),
        }
        answer = target.owner("POST", f"{target.path}/scans/{scan}/photos", headers=headers)
        yield _finding(f"announce photo {name!r} of {size} bytes", answer)


def spelled_numbers(target: Target) -> Iterator[Finding]:
    """Numbers that Python reads and HTTP does not know."""
    wall = target.made("/walls", {"name": "Roof"})["id"]
    scan = target.made(f"/walls/{wall}/scans")["id"]
    for number in ("+5", "1_0", "5.0", "0x5"):
        headers = {
            "tus-resumable": "1.0.0",
            "upload-length": number,
            "upload-metadata": f"filename {base64.b64encode(b'a.jpg').decode()}",
        }
        answer = target.owner("POST", f"{target.path}/scans/{scan}/photos", headers=headers)
        yield _finding(f"announce photo of {number} bytes", answer)
        answer = target.nobody("GET", f"{API}/gyms", params={"size": number})
        yield _finding(f"page of {number} lines", answer)


def long_bodies(target: Target) -> Iterator[Finding]:
    """Bodies that are too long, whose length is announced or not."""
    pieces = [b" " * 100_000] * 21
    requests = [("PATCH", f"{API}/me"), ("POST", f"{API}/session"), ("POST", f"{API}/nothing")]
    for method, path in requests:
        for name, body in (("announced", b"".join(pieces)), ("growing", iter(pieces))):
            attack = f"{method} {path} with a long body, {name}"
            try:
                yield _finding(attack, target.owner(method, path, content=body))
            except httpx.TransportError as error:  # the server did not wait for the rest
                yield Finding(attack, is_held=True, answer=str(error))


@dataclass
class Cup:
    """A running self-scoring competition of the target, which the climber has entered.

    Parameters
    ----------
    place : its address; entry, problem : ids of the climber's entry and of its only problem.
    """

    target: Target
    place: str = ""
    entry: str = ""
    problem: str = ""
    entering: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        target = self.target
        cup = target.made(
            "/competitions",
            {
                "name": "Cup",
                "format": "festival",
                "categories": [{"name": "Open"}],
                "self_entry": True,
                "self_scoring": True,
                "rounds": [
                    {"name": "Session", "scoring": {"rules": "points"}, "problems": [{"name": "A"}]}
                ],
            },
        )
        self.place = f"{target.path}/competitions/{cup['id']}"
        running = target.owner("PUT", f"{self.place}/state", json={"state": "running"}).json()
        self.problem = running["rounds"][0]["problems"][0]["id"]
        target.climber("POST", f"{target.path}/join")
        self.entering = {"category_id": running["categories"][0]["id"]}
        entered = target.climber("PUT", f"{self.place}/mine", json=self.entering)
        self.entry = entered.json()["entry"]["id"]

    def say(self, client: Send, kind: str, number: int, **words: Any) -> tuple[str, httpx.Response]:
        """Send a score event; return its id and the answer."""
        event, moment = str(uuid4()), datetime.now(UTC).isoformat()
        body = {
            "entry_id": self.entry,
            "kind": kind,
            "device": "attack",
            "number": number,
            "made_at": moment,
            "sent_at": moment,
        } | words
        return event, client("PUT", f"{self.place}/events/{event}", json=body)

    def counts(self, event: str) -> bool:
        """Tell whether a stored event counts."""
        items = self.target.owner("GET", f"{self.place}/events").json()["items"]
        return any(item["id"] == event and item["counts"] for item in items)


def judged_events(target: Target) -> Iterator[Finding]:
    """Strike a judge's event by an appeal or a void; enter again after a withdrawal."""
    cup = Cup(target)
    out, answer = cup.say(target.owner, "out", 1, text="on the mat")
    if not cup.counts(out):
        raise RuntimeError(f"the judge's event does not count: {answer.text[:200]}")
    own: list[tuple[str, dict[str, object]]] = [
        ("appeal", {"target_id": out, "text": "no"}),
        ("void", {"target_id": out}),
        ("void", {"target_id": out, "problem_id": cup.problem}),
        ("top", {"target_id": out, "problem_id": cup.problem, "n": 1}),
    ]
    for number, (kind, words) in enumerate(own, start=2):
        _, answer = cup.say(target.climber, kind, number, **words)
        yield Finding(f"competitor's {kind} on a judge's event", cup.counts(out), answer.text[:80])
    cup.say(target.owner, "void", 6, target_id=out)
    top, answer = cup.say(target.climber, "top", 7, problem_id=cup.problem, n=1)
    if not cup.counts(top):
        raise RuntimeError(f"the climber's event does not count: {answer.text[:200]}")
    cup.say(target.owner, "void", 8, target_id=top)
    _, answer = cup.say(target.climber, "top", 9, problem_id=cup.problem, n=1)
    yield _finding("enter a top again that a judge struck", answer, *FORBIDDEN)
    gone = target.owner("PATCH", f"{cup.place}/entries/{cup.entry}", json={"withdrawn": True})
    if not gone.is_success:
        raise RuntimeError(f"the gym cannot withdraw an entry: {gone.text[:200]}")
    answer = target.climber("PUT", f"{cup.place}/mine", json=cup.entering)
    yield _finding("enter again after the gym withdrew the entry", answer)


def long_chains(target: Target) -> Iterator[Finding]:
    """Void one's own top, then the void, then the void of that, and so on."""
    cup = Cup(target)
    event, answer = cup.say(target.climber, "top", 1, problem_id=cup.problem, n=1)
    for number in range(2, 60):
        if not answer.is_success:
            break
        event, answer = cup.say(
            target.climber, "void", number, problem_id=cup.problem, target_id=event
        )
    yield _finding("60 events that strike each other in a row", answer)


def edges(target: Target) -> Iterator[Finding]:
    """Moments at the calendar's edges, and numbers that no database holds."""
    body = {
        "name": "Never",
        "format": "festival",
        "categories": [{"name": "Open"}],
        "rounds": [{"name": "One", "scoring": {"rules": "points"}, "problems": [{"name": "A"}]}],
    }
    for moment in ("9999-12-31T23:59:59Z", "0001-01-01T00:00:00Z", "not a time"):
        answer = target.owner(
            "POST", f"{target.path}/competitions", json=body | {"starts_at": moment}
        )
        yield _finding(f"competition at {moment}", answer)
        for path in ("/board", "/insights", "/progress"):
            answer = target.owner("GET", target.path + path, params={"at": moment})
            yield Finding(f"{path}?at={moment}", answer.status_code < 500, str(answer.status_code))
    for value in (10**30, -(10**30), "1e400"):
        answer = target.nobody("GET", f"{API}/gyms", params={"size": value})
        yield _finding(f"page of {value} lines", answer)
        answer = target.owner("POST", f"{target.path}/walls", json={"name": "Deep", "place": value})
        yield _finding(f"wall at place {value}", answer)


def webhook_addresses(target: Target) -> Iterator[Finding]:
    """Addresses of this machine or its network; names are resolved and refused at delivery."""
    for host in (
        "127.0.0.1",
        "10.0.0.1",
        "169.254.169.254",
        "[::1]",
        "[::ffff:127.0.0.1]",
        "[64:ff9b::7f00:1]",
        "[2002:7f00:1::]",
        "[::127.0.0.1]",
        "[fd00::1]",
        f"{'a' * 64}.example",
    ):
        answer = target.owner(
            "POST", f"{target.path}/webhooks", json={"url": f"https://{host}/hook"}
        )
        yield _finding(f"webhook to {host}", answer)


def _png(width: int, height: int) -> bytes:
    """A small PNG that claims a size and unpacks to nothing of it."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + check

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    rows = zlib.compress(b"\0" * 100_000)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def floor_plans(target: Target) -> Iterator[Finding]:
    """Pictures that are small to send and large to decode."""
    for width, height in ((60_000, 60_000), (2**31 - 1, 1), (0, 0)):
        answer = target.owner(
            "PUT",
            f"{target.path}/floor-plan/picture",
            content=_png(width, height),
            headers={"content-type": "image/png"},
        )
        yield _finding(f"floor plan of {width} by {height} pixels", answer)


def rights(target: Target) -> Iterator[Finding]:
    """Requests of the owner, sent by a climber and by nobody."""
    requests: list[tuple[str, str, object]] = [
        ("GET", "/members", None),
        ("GET", "/audit", None),
        ("GET", "/webhooks", None),
        ("POST", "/walls", {"name": "Mine"}),
        ("PATCH", "", {"name": "Mine"}),
        ("DELETE", "", None),
        ("POST", "/invitations", {"email": "a@example.com", "role": "owner"}),
        ("POST", "/competitions", {}),
        ("GET", "/insights", None),
        ("POST", "/hall/key", None),
    ]
    for method, path, body in requests:
        for name, client in (("a climber", target.climber), ("nobody", target.nobody)):
            answer = client(method, target.path + path, json=body)
            yield _finding(f"{method} {path or '/'} by {name}", answer, *FORBIDDEN)


def sign_ins(target: Target) -> Iterator[Finding]:
    """Guess a password many times at once; ten guesses are allowed."""
    body = {"email": f"{secrets.token_hex(8)}@example.com", "password": "not the password"}
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        answers = list(
            pool.map(lambda _: target.nobody("POST", f"{API}/session", json=body), range(_AT_ONCE))
        )
    tried = sum(answer.status_code != 429 for answer in answers)
    yield Finding(f"{_AT_ONCE} guesses at once", tried <= _GUESSES, f"{tried} were tried")


ATTACKS: tuple[Callable[[Target], Iterator[Finding]], ...] = (
    photo_names,
    spelled_numbers,
    long_bodies,
    judged_events,
    long_chains,
    edges,
    webhook_addresses,
    floor_plans,
    rights,
    sign_ins,
)


def attack(target: Target) -> list[Finding]:
    """Run all attacks on a gym that is made for them, and close it."""
    made = target.owner(
        "POST",
        f"{API}/gyms",
        json={"name": "Attack", "slug": target.gym, "visibility": "public", "joining": "open"},
    )
    if made.status_code != 201:
        raise RuntimeError(f"the owner cannot make a gym: {made.status_code} {made.text[:200]}")
    try:
        return [finding for one in ATTACKS for finding in one(target)]
    finally:
        target.owner("DELETE", target.path)


def _signed_in(address: str, given: str) -> Send:
    client = httpx.Client(base_url=address, headers={"origin": address}, timeout=60)
    email, _, password = given.partition(":")
    if email:
        answer = client.post(f"{API}/session", json={"email": email, "password": password})
        if not answer.is_success:
            raise RuntimeError(f"{email} cannot sign in: {answer.status_code} {answer.text[:200]}")
        # By hand: httpx sends no secure cookie to http://localhost, as browsers do.
        cookies = answer.headers.get_list("set-cookie")
        client.headers["cookie"] = "; ".join(cookie.partition(";")[0] for cookie in cookies)
    return client.request


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; prints what was not refused."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("address", help="such as http://localhost:8000")
    parser.add_argument("--owner", required=True, metavar="MAIL:PASSWORD")
    parser.add_argument("--climber", required=True, metavar="MAIL:PASSWORD")
    args = parser.parse_args(arguments)
    owner, climber, nobody = (
        _signed_in(args.address.rstrip("/"), given) for given in (args.owner, args.climber, "")
    )
    findings = attack(Target(owner, climber, nobody))
    broken = [finding for finding in findings if not finding.is_held]
    for finding in broken:
        print(f"NOT REFUSED: {finding.attack}: {finding.answer}")
    print(f"{len(findings)} attacks, {len(broken)} not refused")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
