"""The figures of the pages, written and checked from the records in `docs/results`.

    python -m tools.pages.figures     # write the tables of README and docs

In a page, a table between

    <!-- figures: NAME -->
    <!-- /figures -->

is that of the record `docs/results/NAME.json` (`NAME 2`: its second one), with a line below that
states command, data, evaluator and date. A figure in prose is a link to its record. The link's
title quotes words of the figure's line in the output:

    ARI [0.692](results/routes-masks.json "by paint")

A score (a number below 1 with three decimals), a share (`12 %`, `3 of 40`), a measure (`0.5 mm`,
`3 s`, `20 MB`), a ratio (`3 times as`) or a cost (`7 CPU-s`, `3.5 GiB`, `33 dB`) outside of both is
stray, because its source is unknown. `CONSTANTS` are no figures: targets, settings, limits, and
sizes of objects.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from tools.pages.records import RESULTS, Record
from walltopo.core.files import atomic_path

# Other commands write these pages.
GENERATED = ("settings.md", "bad-input.md")
BLOCK = re.compile(r"(<!-- figures: ([\w-]+)(?: (\d+))? -->\n).*?(<!-- /figures -->)", re.DOTALL)
LINK = re.compile(r"\[([^\]\n]+)\]\(([\w/.-]*results/([\w-]+)\.json)(?:\s+\"([^\"]*)\")?\)")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d*\.?\d+(?!\w)")
STRAY = re.compile(
    r"(?<![\w.,])(?:0?\.\d{3}|1\.000)(?!\w|\.\d)"  # a score
    r"|\b\d+ of \d{2,}\b"  # a share
    r"|(?<![\w.,])\d+\.\d+ px\b"  # a length in a picture
    r"|(?<![\w.,])(?:\d[\d.,]*)?\d (?:(?:mm|ms|s|min|MB)\b(?![/²])|%)"  # a measure, a share
    r"|(?<![\w.,])\d[\d.]* times (?:as|the|longer|faster|more|what)\b"  # a ratio
    r"|\b\d[\d.,]* (?:CPU-s\b|CPU-seconds|dB\b)|\b\d+\.\d+ Gi?B\b"  # what it cost
)
CODE = re.compile(r"```.*?```|`[^`\n]*`|^ {4,}[^\n]*$", re.DOTALL | re.MULTILINE)

# Targets, settings, limits and sizes of objects: not measured, and therefore in no record.
CONSTANTS: dict[str, tuple[str, ...]] = {
    "colours.md": ("5 mm", "10 %", "15 %", "40 %"),
    "dense.md": ("8 mm", "50 mm", "20 %"),
    "evaluate.md": ("8 mm", "10 mm", "20 mm"),
    "gym.md": ("150 MB",),
    "results.md": ("30 s", "5 mm", "1 mm", "8 mm", "10 mm", "1 s"),
    "lift-figures.md": ("12 mm",),
    "measure.md": (
        *("420 mm", "297 mm", "210 mm", "4 mm", "150 mm", "115 mm", "80 mm"),
        *("216 mm", "75 mm"),  # the plates
        *("100 %", "1 %"),
    ),
    "routes.md": ("20 s",),
    "security.md": ("8 MB",),
    **{f"setter{language}.md": ("100 %",) for language in ("", ".cs", ".de", ".fr")},
    "synth.md": ("35 mm", "3 mm"),
    "viewer.md": ("170 ms",),
}


def pages(root: Path) -> list[Path]:
    """Return README and the hand-written pages of docs."""
    return [
        root / "README.md",
        *(page for page in sorted((root / "docs").glob("*.md")) if page.name not in GENERATED),
    ]


def caption(record: Record, name: str, folder: str) -> str:
    """Return the line below a table."""
    parts = [f"`{record.command}`", record.on]
    parts += [f"evaluator: {record.evaluator}"] if record.evaluator else []
    parts += [f"classes: {record.classes}"] if record.classes else []
    if record.measured is not None:
        when = f"{record.measured.date}, {record.measured.version} ({record.measured.revision})"
        parts.append(
            f"[{'copied' if record.transcribed else 'measured'} {when}]({folder}{name}.json)"
        )
    return f"*{'; '.join(parts)}.*"


def written(page: Path, root: Path) -> str:
    """Return the text of the page with its tables as recorded."""
    folder = "results/" if page.parent.name == "docs" else f"{RESULTS}/"

    def block(found: re.Match[str]) -> str:
        begin, name, number, end = found.groups()
        record = Record.load(root / RESULTS / f"{name}.json")
        kept = record.tables()
        chosen = kept if number is None else kept[int(number) - 1 : int(number)]
        text = "\n\n".join("\n".join(rows) for rows in chosen)
        return f"{begin}\n{text}\n\n{caption(record, name, folder)}\n\n{end}"

    return BLOCK.sub(block, page.read_text(encoding="utf-8"))


def _agrees(figure: str, line: str) -> bool:
    """Return whether a line contains every number of a text, to the decimals of the text."""
    known = [float(number) for number in NUMBER.findall(line)]
    for number in NUMBER.findall(figure.replace(",", "")):
        decimals = len(number.partition(".")[2])
        scale = 100.0 if "%" in figure and "%" not in line else 1.0
        if not any(
            abs(scale * value - float(number)) <= 0.50001 * 10**-decimals for value in known
        ):
            return False
    return True


def _links(text: str, root: Path) -> Iterator[str]:
    for figure, _, name, words in LINK.findall(text):
        path = root / RESULTS / f"{name}.json"
        if not path.is_file():
            yield f"[{figure}]: there is no record {path.name}"
            continue
        lines = [line.replace(",", "") for line in Record.load(path).output]
        wanted = (words or "").replace(",", "")
        if NUMBER.search(figure) and not any(wanted in s and _agrees(figure, s) for s in lines):
            yield f"[{figure}]: {path.name} has no line with {words!r} that says so"


def complaints(page: Path, root: Path) -> list[str]:
    """Return the differences between a page's figures and the records; empty if there is none."""
    text = page.read_text(encoding="utf-8")
    found = [] if written(page, root) == text else ["a table is not as recorded: run `make docs`"]
    bare = BLOCK.sub("", text)
    found += _links(bare, root)
    stray = STRAY.findall(CODE.sub("", LINK.sub("", bare)))
    known = CONSTANTS.get(page.name, ())
    found += [f"{number} comes from no record" for number in stray if number not in known]
    found += [
        f"{number} is no constant of this page any more" for number in known if number not in stray
    ]
    return [f"{page.name}: {line}" for line in found]


def main() -> None:
    """Write the tables of all pages."""
    for page in pages(Path()):
        text = written(page, Path())
        with atomic_path(page) as temporary:
            temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
