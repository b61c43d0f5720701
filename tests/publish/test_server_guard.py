"""Access rules of the local server: the promises of docs/security.md."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from made_scan import build_scan  # type: ignore[import-not-found]
from served import connect, head, rest, served, talk  # type: ignore[import-not-found]

from walltopo.core import SettingsError
from walltopo.editing.log_file import EditLogFile
from walltopo.publish.server.address import check_origin, listen
from walltopo.publish.server.guard import MAX_BODY
from walltopo.publish.server.run import Server
from walltopo.scans.edits import SetHold
from walltopo.scans.folder import ScanFolder

EDITS = [{"do": "hold", "hold": {"id": 3, "at": [1, 0, 2]}, "colour": "red"}]
# "none" is the version of a scan that nobody has edited.
BODY = json.dumps({"version": "none", "edits": {"version": 2, "edits": EDITS}}).encode()


def build(root: Path) -> ScanFolder:
    made: ScanFolder = build_scan(root, cells=20)
    made.page.write_text("<wall-topo src=x></wall-topo>")
    (made.root / "page").mkdir()
    (made.root / "page" / "first.js").write_text("0123456789")
    (made.cutouts / "1.png").write_bytes(b"png")
    return made


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for all tests, with things beside the page that nobody may get."""
    room = tmp_path_factory.mktemp("served")
    scan = build(room / "scan")
    (room / "secret.js").write_text("secret")
    (scan.root / "page" / ".hidden").write_text("secret")
    (scan.root / "page" / "link.js").symlink_to(room / "secret.js")
    (scan.root / "page" / "inside.js").symlink_to(scan.root / "scan.json")
    (scan.cutouts / "folder").mkdir()
    with served(scan.root, edit=True) as server:
        yield server


@pytest.fixture
def server(running: Server) -> Iterator[Server]:
    """The same, without what an earlier test has saved."""
    yield running
    running.scan.edits.unlink(missing_ok=True)


@pytest.fixture
def scan(running: Server) -> ScanFolder:
    return running.scan


def host(server: Server) -> str:
    return f"localhost:{server.address.port}"


def get(server: Server, path: str, **headers: str) -> tuple[int, str]:
    """Status and everything else that came."""
    requests = {"Host": host(server), "Connection": "close"} | headers
    shown = talk(server, head("GET", path, **requests)).decode("latin-1")
    return int(shown.split()[1]), shown


def write_headers(server: Server, **changed: str | None) -> dict[str, str]:
    """Return a save's headers as the page sends them, with a test's changes (None: left out)."""
    own: dict[str, Any] = {
        "Host": host(server),
        "Origin": f"http://{host(server)}",
        "Content_Type": "application/json",
        "Content_Length": str(len(BODY)),
        "X_Walltopo_Token": server.token,
    }
    return {name: value for name, value in (own | changed).items() if value is not None}


def test_a_save_as_the_page_sends_it(server: Server, scan: ScanFolder) -> None:
    requests = write_headers(server, Connection="close", Sec_Fetch_Site="same-origin")
    shown = talk(server, head("POST", "/api/edits", **requests), BODY)
    assert shown.startswith(b"HTTP/1.1 200")
    log, version = EditLogFile(scan).read()
    assert [type(edit) for edit in log.edits] == [SetHold]
    answer = json.loads(shown.split(b"\r\n\r\n")[1])
    assert answer["version"] == version
    assert [row["colour"] for row in answer["result"]["holds"] if row["id"] == 3] == ["red"]


# Faulty headers of a write, and the status of the answer.
WRONG: dict[str, tuple[dict[str, str | None], int]] = {
    "a form of another page": (
        {"Origin": "http://evil.example", "Content_Type": "text/plain"},
        403,
    ),
    "another page": ({"Origin": "http://evil.example"}, 403),
    "a page of another port": ({"Origin": "http://localhost:1"}, 403),
    "a page without an origin": ({"Origin": "null"}, 403),
    "no origin": ({"Origin": None}, 403),
    "text": ({"Content_Type": "text/plain"}, 415),
    "no type": ({"Content_Type": None}, 415),
    "a type that begins well": ({"Content_Type": "application/jsonp"}, 415),
    "no token": ({"X_Walltopo_Token": None}, 403),
    "a wrong token": ({"X_Walltopo_Token": "x" * 32}, 403),
    "the root of the name system": ({"Host": "localhost.:1"}, 403),
    "a foreign name": ({"Host": "evil.example"}, 403),
    "another site, says the browser": ({"Sec_Fetch_Site": "cross-site"}, 403),
    "another port, says the browser": ({"Sec_Fetch_Site": "same-site"}, 403),
    "no length": ({"Content_Length": None}, 411),
    "chunks": ({"Content_Length": None, "Transfer_Encoding": "chunked"}, 411),
    "a length below zero": ({"Content_Length": "-5"}, 400),
    "a length of no number": ({"Content_Length": "1e3"}, 400),
    "two lengths": ({"Content_Length": "5, 6"}, 400),
    "a length without end": ({"Content_Length": "9" * 19}, 413),
    "a length of 5,000 digits": ({"Content_Length": "9" * 5000}, 400),
    "too much": ({"Content_Length": str(MAX_BODY + 1)}, 413),
}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("cut", [False, True], ids=["in one piece", "body later"])
def test_a_refused_write_saves_nothing_and_its_body_is_no_request(
    server: Server, scan: ScanFolder, kind: str, cut: bool
) -> None:
    """The attack: the body of a request that is refused is a whole request that would not be."""
    changed, status = WRONG[kind]
    inner = head("POST", "/api/edits", **write_headers(server)) + BODY
    requests = write_headers(server, Content_Length=str(len(inner)))
    requests = {name: value for name, value in (requests | changed).items() if value is not None}
    outer = head("POST", "/api/edits", **requests)
    shown = talk(server, outer, inner) if cut else talk(server, outer + inner)
    codes = [int(code) for code in re.findall(rb"HTTP/1\.1 (\d+)", shown)]
    # A body that is no chunk may be seen before the head is refused.
    assert codes == [status] or (kind == "chunks" and codes == [400])
    assert b"connection: close" in shown.lower()
    assert not scan.edits.exists()
    # The inner one alone is saved: the attack was a real one.
    with connect(server) as wire:
        wire.sendall(inner)
        assert wire.recv(12) == b"HTTP/1.1 200"
    assert scan.edits.exists()


def test_a_save_on_old_edits_is_refused(server: Server, scan: ScanFolder) -> None:
    requests = head("POST", "/api/edits", **write_headers(server))
    with connect(server) as wire:
        wire.sendall(requests + BODY)
        assert wire.recv(12) == b"HTTP/1.1 200"
    before = scan.edits.read_bytes()
    shown = talk(server, requests, BODY.replace(b"red", b"tan"))
    assert shown.startswith(b"HTTP/1.1 412")
    assert b"other edits were saved" in shown
    assert scan.edits.read_bytes() == before


@pytest.mark.parametrize("method", ["GET", "HEAD", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH"])
@pytest.mark.parametrize("path", ["/", "/api/edits", "/nothing"])
def test_a_body_where_none_belongs_is_no_request(
    server: Server, scan: ScanFolder, method: str, path: str
) -> None:
    inner = head("POST", "/api/edits", **write_headers(server)) + BODY
    requests = {"Host": host(server), "Content_Length": str(len(inner))}
    shown = talk(server, head(method, path, **requests) + inner)
    codes = re.findall(rb"HTTP/1\.1 (\d+)", shown)
    assert len(codes) == 1
    assert codes[0] in (b"400", b"403", b"405")
    assert not scan.edits.exists()


@pytest.mark.parametrize(
    "body",
    [
        b"{",
        b"[" * 100_000,
        b"1" * 5000,
        b"\xff\xfe",
        BODY.replace(b'"version": "none", ', b""),
        BODY.replace(b"red", b"\\ud800"),
        BODY.replace(b'"id": 3', b'"id": 1e20'),
        BODY.replace(b"[1, 0, 2]", b"[1, 0, 1e300]"),
        BODY.replace(b'"hold", "hold"', b'"blow", "hold"'),
        BODY.replace(b'"hold": {', b'"holds": {'),
        BODY.replace(b'"version": 2', b'"version": 3'),
    ],
)
def test_a_body_that_cannot_be_saved_gives_a_sentence(
    server: Server, scan: ScanFolder, body: bytes
) -> None:
    requests = write_headers(server, Content_Length=str(len(body)))
    shown = talk(server, head("POST", "/api/edits", **requests), body)
    assert shown.startswith(b"HTTP/1.1 400")
    text = json.loads(shown.split(b"\r\n\r\n")[1])["error"]
    assert len(text) > 10
    assert str(scan.root) not in text
    assert not scan.edits.exists()


@pytest.mark.parametrize(
    ("name", "status"),
    [
        ("localhost:PORT", 200),
        ("LOCALHOST:PORT", 200),
        ("127.0.0.1:PORT", 200),
        ("[::1]:PORT", 200),
        ("localhost.:PORT", 403),
        ("localhost", 403),
        ("localhost:1", 403),
        ("localhost:PORT.", 403),
        ("evil.example:PORT", 403),
        ("localhost.evil.example:PORT", 403),
        ("user@localhost:PORT", 403),
        ("127.1:PORT", 403),
        ("0.0.0.0:PORT", 403),
        ("", 403),
    ],
)
def test_answers_to_its_own_names_only(server: Server, name: str, status: int) -> None:
    assert get(server, "/", Host=name.replace("PORT", str(server.address.port)))[0] == status


def test_names_it_once(server: Server) -> None:
    own = f"Host: {host(server)}\r\n".encode()
    assert talk(server, b"GET / HTTP/1.1\r\n" + own + b"Host: evil.example\r\n\r\n").startswith(
        b"HTTP/1.1 400"
    )
    assert talk(server, b"GET / HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 403")


@pytest.mark.parametrize(
    ("site", "mode", "dest", "status"),
    [
        ("none", "navigate", "document", 200),
        ("same-origin", "no-cors", "script", 200),
        ("cross-site", "navigate", "document", 200),  # somebody followed a link
        ("cross-site", "no-cors", "script", 403),
        ("cross-site", "no-cors", "image", 403),
        ("same-site", "no-cors", "script", 403),
        ("cross-site", "cors", "empty", 403),
        ("cross-site", "navigate", "iframe", 403),
        ("cross-site", "navigate", "object", 403),
    ],
)
def test_what_other_pages_may_ask_for(
    server: Server, site: str, mode: str, dest: str, status: int
) -> None:
    shown = get(
        server, "/page/first.js", Sec_Fetch_Site=site, Sec_Fetch_Mode=mode, Sec_Fetch_Dest=dest
    )
    assert shown[0] == status


@pytest.mark.parametrize("path", ["/", "/page/first.js", "/cutouts/1.png", "/none", "/api/edits"])
def test_every_answer_keeps_other_pages_out(server: Server, path: str) -> None:
    _, shown = get(server, path)
    for line in (
        "cross-origin-resource-policy: same-origin",
        "x-content-type-options: nosniff",
        "referrer-policy: no-referrer",
        "frame-ancestors 'none'",
        "default-src 'none'",
    ):
        assert line in shown
    assert "access-control-allow" not in shown


def test_a_frame_is_by_a_flag_and_never_for_the_editor(scan: ScanFolder) -> None:
    with served(scan.root, edit=True, embed=["https://gym.example/"]) as server:
        requests = {
            "Sec_Fetch_Site": "cross-site",
            "Sec_Fetch_Mode": "navigate",
            "Sec_Fetch_Dest": "iframe",
        }
        status, shown = get(server, "/", **requests)
        assert status == 200
        assert "frame-ancestors https://gym.example\r\n" in shown
        assert get(server, "/page/first.js", Sec_Fetch_Site="cross-site")[0] == 403
        assert "frame-ancestors 'none'" in get(server, f"/?token={server.token}")[1]


@pytest.mark.parametrize(
    "origin",
    [
        "gym.example",
        "https://gym.example/wall",
        "https://*",
        "https://a b",
        "https://a; img-src *",
        "",
    ],
)
def test_what_is_no_origin_reaches_no_header(origin: str) -> None:
    with pytest.raises(SettingsError, match="not an origin"):
        check_origin(origin)


def test_the_token_is_given_only_to_who_has_it(server: Server) -> None:
    assert server.token is not None
    for path in ("/", "/index.html", "/?token=", f"/?token={server.token[:-1]}", "/api/edits"):
        assert server.token not in get(server, path)[1]
    assert get(server, "/")[0] == 200
    assert " edit " not in get(server, "/")[1]
    assert get(server, "/?token=wrong")[0] == 403
    status, shown = get(server, f"/?token={server.token}")
    assert status == 200
    assert f'<wall-topo edit token="{server.token}" ' in shown
    assert "cache-control: no-store" in shown
    assert get(server, "/api/edits")[0] == 403
    status, shown = get(server, "/api/edits", X_Walltopo_Token=server.token)
    assert status == 200
    assert "cache-control: no-store" in shown


def test_each_run_has_a_token_of_its_own(scan: ScanFolder) -> None:
    tokens = set()
    for _ in range(3):
        with served(scan.root, edit=True) as server:
            tokens.add(server.token)
    assert len(tokens) == 3
    assert all(token is not None and len(token) >= 32 for token in tokens)


def test_without_edit_nothing_is_read_or_saved(scan: ScanFolder) -> None:
    with served(scan.root, edit=False) as server:
        for token in (None, "", "None"):
            requests = write_headers(server, X_Walltopo_Token=token)
            shown = talk(server, head("POST", "/api/edits", **requests), BODY)
            assert shown.startswith(b"HTTP/1.1 404")
        assert get(server, "/api/edits")[0] == 404
        assert " edit " not in get(server, "/?token=None")[1]
    assert not scan.edits.exists()


SECRETS = [
    "/scan.json",
    "/photos/IMG_1.jpg",
    "/page/../scan.json",
    "/page/%2e%2e/scan.json",
    "/page/..%2fscan.json",
    "/page%2ffirst.js",
    "/page%5cfirst.js",
    "/../../etc/passwd",
    "//etc/passwd",
    "/etc/passwd",
    "/page",
    "/page/",
    "/page/.hidden",
    "/.lock",
    "/page/%00",
    "/page/first.js%00.png",
    "/page/first.js/",
    "/page//first.js",
    "/page/./first.js",
    "/page/%0a",
    "/holds.edits.json",
    "/edits.json",
    "/%69ndex.html",
    "/page/link.js",
    "/page/inside.js",
    "/cutouts/folder",
    "/page/%c3%28",
    "/page/" + "a" * 300,
    "http://evil.example/index.html",
]


@pytest.mark.parametrize("path", SECRETS)
def test_nothing_else_of_the_disk_is_served(server: Server, scan: ScanFolder, path: str) -> None:
    status, shown = get(server, path)
    assert status == 404
    assert str(scan.root.parent) not in shown
    assert "secret" not in shown


def test_a_linked_folder_is_not_followed(tmp_path: Path) -> None:
    scan = build(tmp_path / "scan")
    (scan.root / "page").rename(tmp_path / "elsewhere")
    (scan.root / "page").symlink_to(tmp_path / "elsewhere")
    with served(scan.root, edit=False) as server:
        assert get(server, "/page/first.js")[0] == 404


def test_parts_heads_and_what_has_not_changed(server: Server) -> None:
    status, shown = get(server, "/page/first.js")
    assert (status, shown[-10:]) == (200, "0123456789")
    assert "content-type: text/javascript" in shown
    tag = re.findall(r"etag: (\S+)", shown)[0]
    assert get(server, "/page/first.js", If_None_Match=tag)[0] == 304
    status, shown = get(server, "/page/first.js", Range="bytes=2-4")
    assert (status, shown[-7:]) == (206, "\r\n\r\n234")
    assert get(server, "/page/first.js", Range="bytes=50-")[0] == 416
    requests = {"Host": host(server), "Connection": "close"}
    shown = talk(server, head("HEAD", "/page/first.js", **requests)).decode()
    assert "content-length: 10" in shown
    assert shown.endswith("\r\n\r\n")


def test_many_requests_on_one_connection(server: Server) -> None:
    with connect(server) as wire:
        for _ in range(20):
            wire.sendall(head("GET", "/page/first.js", Host=host(server)))
            shown = b""
            while not shown.endswith(b"0123456789"):
                shown += wire.recv(4096)
        wire.sendall(head("GET", "/none", Host=host(server)))
        assert rest(wire).startswith(b"HTTP/1.1 404")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("0.0.0.0", "every address"),
        ("::", "every address"),
        ("localhost.", "neither a name nor an address"),
        ("evil.example/", "neither a name nor an address"),
        ("a\r\nb", "neither a name nor an address"),
        ("", "neither a name nor an address"),
        ("192.0.2.1", "not an address of this machine"),
    ],
)
def test_hosts_that_cannot_be_listened_on(name: str, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        listen(name, 0)


def test_another_host_answers_to_that_name_alone() -> None:
    wire, address = listen("127.0.0.2", 0)
    wire.close()
    assert address.names == {f"127.0.0.2:{address.port}"}
    assert not address.local


@pytest.mark.slow
def test_in_a_network_reading_is_open_and_saving_needs_the_token(tmp_path: Path) -> None:
    """127.0.0.2 stands for an address in the network: it is another one of this machine."""
    scan = build(tmp_path / "scan")
    with served(scan.root, edit=True, host="127.0.0.2") as server:
        own = f"127.0.0.2:{server.address.port}"
        assert get(server, "/", Host=own)[0] == 200
        assert get(server, "/", Host=host(server))[0] == 403
        # Another program may listen at the same port of 127.0.0.1.
        ours = psutil.Process().net_connections("tcp")
        listening = [c.laddr for c in ours if c.status == psutil.CONN_LISTEN]
        port = server.address.port
        assert [where.ip for where in listening if where.port == port] == ["127.0.0.2"]
        requests = write_headers(server, Host=own, Origin=f"http://{own}")
        without = head("POST", "/api/edits", **requests | {"X_Walltopo_Token": ""})
        assert talk(server, without, BODY).startswith(b"HTTP/1.1 403")
        assert not scan.edits.exists()
        assert talk(server, head("POST", "/api/edits", **requests), BODY).startswith(
            b"HTTP/1.1 200"
        )
        assert any("not encrypted" in line for line in server.notes())
