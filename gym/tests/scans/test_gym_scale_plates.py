"""The scale plates to print, as the app offers them."""

from __future__ import annotations

import pytest
from gym.tests.worlds import Server


@pytest.mark.parametrize(
    ("paper", "box"),
    [("a4", b"841.8898 595.2756"), ("a3", b"1190.5512 841.8898"), ("letter", b"792.0000 612.0000")],
)
def test_a_plate_is_a_page_of_its_paper(server: Server, paper: str, box: bytes) -> None:
    answer = server.ask("GET", f"/scale-plates/{paper}/1.pdf")
    assert answer.headers["content-type"] == "application/pdf"
    assert answer.content.startswith(b"%PDF")
    assert b"/MediaBox [0 0 " + box in answer.content
    again = server.ask(
        "GET", f"/scale-plates/{paper}/1.pdf", headers={"if-none-match": answer.headers["etag"]}
    )
    assert again.status_code == 304


def test_plates_of_one_paper_differ_and_end(server: Server) -> None:
    first, second = (server.ask("GET", f"/scale-plates/a4/{n}.pdf").content for n in (1, 2))
    assert first != second
    none = server.ask("GET", "/scale-plates/letter/2.pdf")
    assert (none.status_code, none.json()["code"]) == (404, "no-such-plate")
    assert server.ask("GET", "/scale-plates/a5/1.pdf").status_code == 422


def test_stickers_come_on_as_many_pages_as_they_need(server: Server) -> None:
    answer = server.ask("GET", "/stickers/a4/24.pdf")
    assert answer.headers["content-type"] == "application/pdf"
    assert b"/Count 4 " in answer.content
    assert server.ask("GET", "/stickers/a4/588.pdf").status_code == 422
