"""The code that a phone scans leads to the wall, and to the editor only where asked for."""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np
import pytest

from walltopo.cli import main
from walltopo.cli.console import Terminal
from walltopo.cli.view import qr_lines, show_qr
from walltopo.publish.server.run import Server

TOKEN = "x" * 32


def _read(lines: list[str], dark_on_light: bool) -> str:
    """Return what a camera makes of it."""
    halves = {" ": (0, 0), "▀": (1, 0), "▄": (0, 1), "█": (1, 1)}
    rows = [[halves[char][k] for char in line] for line in lines for k in (0, 1)]
    drawn = np.array(rows, dtype=np.uint8) * 255
    picture = np.pad(255 - drawn if dark_on_light else drawn, 4, constant_values=255)
    large = np.kron(picture, np.ones((8, 8), dtype=np.uint8))
    # The other detector of OpenCV fails at one code in eighty, at any size.
    return str(cv2.QRCodeDetectorAruco().detectAndDecode(large)[0])


@pytest.mark.parametrize("dark_on_light", [True, False])
@pytest.mark.parametrize(
    "address", ["http://192.168.1.20:8000/", f"http://gym.local:8000/?token={TOKEN}"]
)
def test_it_can_be_read(address: str, dark_on_light: bool) -> None:
    assert _read(qr_lines(address, dark_on_light), dark_on_light) == address


@pytest.mark.parametrize(
    ("terminal", "width", "drawn"), [(True, 80, 1), (True, 20, 0), (False, 80, 0)]
)
def test_it_is_drawn_where_it_can_be_scanned(terminal: bool, width: int, drawn: bool) -> None:
    stream = io.StringIO()
    console = Terminal(file=stream, force_terminal=terminal, width=width, color_system=None)
    assert show_qr(console, "http://192.168.1.20:8000/") == drawn
    assert ("█" in stream.getvalue()) == drawn


@pytest.mark.parametrize("edit", [[], ["--edit"]])
@pytest.mark.parametrize("host", ["127.0.0.2", "127.0.0.1"])
def test_view_shows_the_address_that_was_requested(
    host: str, edit: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """127.0.0.2 is this machine too, but no name of the loopback that `view` knows."""
    (tmp_path / "index.html").write_text("a page")
    stream = io.StringIO()
    console = Terminal(file=stream, force_terminal=True, width=80, color_system=None)
    shown: list[Server] = []

    def run(self: Server) -> None:
        shown.append(self)
        self.socket.close()

    monkeypatch.setattr("walltopo.cli.console.console", console)
    monkeypatch.setattr(Server, "run", run)
    assert main(["view", str(tmp_path), "--port", "0", "--host", host, *edit]) == 0
    lines = [line for line in stream.getvalue().split("\n") if set(line) <= set(" ▀▄█") and line]
    output = " ".join(stream.getvalue().split())
    if host == "127.0.0.1":
        assert not lines
        return
    assert _read(lines, dark_on_light=False) == shown[0].url
    assert ("token" in _read(lines, dark_on_light=False)) == bool(edit)
    assert ("it includes the token" in output) == bool(edit)
