"""A QR code in the terminal, for a phone that shall open an address."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

BORDER = 2  # of light modules; phones find the code with less than the standard's four
# (upper module dark, lower module dark) to the character that draws both
_HALVES = {(0, 0): " ", (1, 0): "▀", (0, 1): "▄", (1, 1): "█"}


def qr_lines(address: str, dark_on_light: bool = True) -> list[str]:
    """The code, two rows of modules a line; `dark_on_light`: what is drawn is dark."""
    import segno

    # `micro=False`: phones' cameras read no Micro QR.
    code = segno.make(address, error="l", micro=False, boost_error=False)
    rows = [[int(bool(module)) for module in row] for row in code.matrix_iter(border=BORDER)]
    if not dark_on_light:
        rows = [[1 - module for module in row] for row in rows]
    if len(rows) % 2:
        rows.append([0 if dark_on_light else 1] * len(rows[0]))
    pairs = zip(rows[::2], rows[1::2], strict=True)
    return ["".join(_HALVES[pair] for pair in zip(*both, strict=True)) for both in pairs]


def show_qr(console: Console, address: str) -> bool:
    """Draw the code where it can be scanned: on a terminal that is wide enough; whether it was."""
    coloured = console.color_system is not None
    lines = qr_lines(address, dark_on_light=coloured)
    if not console.is_terminal or len(lines[0]) > console.width:
        return False
    style = "black on bright_white" if coloured else ""  # without: as on a dark background
    for line in lines:
        console.print(Text(line, style), soft_wrap=True)
    return True
