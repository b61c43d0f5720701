"""`make docs-check`: check the documentation against the code, the tests and the records.

    python -m tools.pages.docs_check

prints each fault on its own line and ends with exit code 1 if there is one.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from tools.pages.figures import GENERATED, complaints, pages
from tools.pages.records import RESULTS, Record
from walltopo.pipeline.settings import settings_markdown
from walltopo.scans.schemas import SCHEMAS, schema_name, schema_text

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
VIEWER_SCHEMA = "viewer.schema.json"  # written by `viewer/wire_types.py`
# Page to the folders of its tests and the minimum number of promises.
PROMISES = {"security.md": (("tests", "viewer/tests"), 15), "gym-security.md": (("gym/tests",), 25)}
MAX_WORDS = 35_000
RESULT_PAGES = "results.md", "lift-figures.md"


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def architecture() -> Iterator[str]:
    """Check that the page names every package, and only files that exist."""
    page = _read(DOCS / "architecture.md")
    product = ROOT / "src" / "walltopo"
    named = set(re.findall(r"`([\w/]+\.py)`", page))
    if len(named) < 40:
        yield "architecture.md: names fewer than 40 files"
    for name in sorted(named):
        if not (product / name).is_file():
            yield f"architecture.md: {name}: no such file"
    for package in sorted(path.parent.name for path in product.glob("*/__init__.py")):
        if not re.search(rf"\b{package}\b", page):
            yield f"architecture.md: the package {package} is missing"


def benchmarks() -> Iterator[str]:
    """Check that every benchmark that a page names exists."""
    for page in (ROOT / "README.md", *sorted(DOCS.glob("*.md")), *sorted(ROOT.glob("lab/*.md"))):
        for name in sorted(set(re.findall(r"((?:gym\.)?benchmarks\.\w+)", _read(page)))):
            file = ROOT / f"{name.replace('.', '/')}.py"
            if not name.endswith(".NAME") and not file.is_file():
                yield f"{page.name}: {name}: no such benchmark"


def publication() -> Iterator[str]:
    """Check that the page has every algorithm, equation and table, and names real files."""
    page = _read(DOCS / "publication.md")

    def section(title: str) -> str:
        return page.split(f"## {title}\n")[1].split("\n## ")[0]

    if re.findall(r"^\| (\d) ", section("Algorithms"), flags=re.M) != list("123456789"):
        yield "publication.md: an algorithm has no row"
    equations: list[int] = []
    for row in re.findall(r"^\| (2\.\d[^|]*)\|", section("Equations"), flags=re.M):
        numbers = [int(n) for n in re.findall(r"\b2\.(\d+)", row)]
        equations += range(numbers[0], numbers[-1] + 1)
    if equations != list(range(1, 32)) or "3.3.3" not in section("Equations"):
        yield "publication.md: an equation has no row"
    tables = sorted(set(re.findall(r"^\| (\d\.\d)", section("Tables"), flags=re.M)))
    if tables != ["1.1", "4.1", "4.2", "4.3", "4.4", "4.5"]:
        yield "publication.md: a table has no row"
    folders = {"": "src/walltopo", "lab:": "lab/src/walltopo_lab"}
    for lab, name in re.findall(r"`(lab:)?([\w/]+\.py)`", page):
        if not (ROOT / folders[lab] / name).is_file():
            yield f"publication.md: {lab}{name}: no such file"


def promises() -> Iterator[str]:
    """Check that each promise of the security pages names a test that exists."""
    for name, (folders, least) in PROMISES.items():
        page = _read(DOCS / name)
        rows = re.findall(
            r"^\| (?!\*\*|\||-)(.+?) \| (.*?) \|$",
            page.split("## Promises")[1].split("\n## ")[0],
            flags=re.M,
        )
        if len(rows) < least:
            yield f"{name}: fewer than {least} promises"
        yield from (
            f"{name}: no test shows: {promise}"
            for promise, shown in rows
            if not re.search(r"`test_|\"", shown)
        )
        files = [path for folder in folders for path in (ROOT / folder).rglob("*")]
        tests = "\n".join(
            _read(path) for path in files if path.suffix == ".mjs" or path.match("test_*.py")
        )
        for test in sorted(set(re.findall(r"`(test_\w+)`", page))):
            if f"def {test}(" not in tests:
                yield f"{name}: {test}: no such test"
        for check in sorted(set(re.findall(r'"([^"]+)" in Chromium', page))):
            if f'test("{check}"' not in tests:
                yield f"{name}: {check!r}: no such browser check"


def figures() -> Iterator[str]:
    """Check that every figure of a page is in a record, and that every record is on a page."""
    listed = pages(ROOT)
    for page in listed:
        yield from complaints(page, ROOT)
    text = "".join(map(_read, listed))
    for path in sorted((ROOT / RESULTS).glob("*.json")):
        record = Record.load(path)
        if record.measured is None or not record.output:
            yield f"{path.name}: says not when it was measured, or what was printed"
        if f"{path.stem}.json" not in text and f"figures: {path.stem}" not in text:
            yield f"{path.name}: on no page"


def length() -> Iterator[str]:
    """Check that the pages have at most `MAX_WORDS` words, without tables and results."""
    total = 0
    for page in DOCS.rglob("*.md"):
        if page.name not in (*GENERATED, *RESULT_PAGES):
            text = re.sub(r"<!-- figures:.*?<!-- /figures -->", "", _read(page), flags=re.S)
            total += len(re.sub(r"\]\([^)\"]*(\"[^\"]*\")?\)", "]", text).split())
    if total > MAX_WORDS:
        yield f"docs: {total} words, at most {MAX_WORDS} are wanted: shorten before you add"


def generated() -> Iterator[str]:
    """Check that the generated pages are current."""
    if _read(DOCS / "settings.md") != settings_markdown():
        yield "settings.md: not current; run `make docs`"
    page = _read(DOCS / "scan-folder.md")
    kept = {path.name for path in (DOCS / "schemas").iterdir()}
    if kept != {*map(schema_name, SCHEMAS), VIEWER_SCHEMA}:
        yield "schemas: other files than the scan folder's and the viewer's; run `make docs`"
    for file in SCHEMAS:
        name = schema_name(file)
        if name in kept and _read(DOCS / "schemas" / name) != schema_text(file):
            yield f"schemas/{name}: not current; run `make docs`"
        if f"(schemas/{name})" not in page:
            yield f"scan-folder.md: does not link schemas/{name}"


def wire_types() -> Iterator[str]:
    """Check that the viewer's types and their schema are current."""
    command = [sys.executable, str(ROOT / "viewer" / "wire_types.py"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        yield from (done.stdout or done.stderr).splitlines()


CHECKS: tuple[Callable[[], Iterator[str]], ...] = (
    architecture,
    benchmarks,
    publication,
    wire_types,
    promises,
    figures,
    length,
    generated,
)


def main() -> int:
    """Print all faults and return the exit code."""
    faults = [fault for check in CHECKS for fault in check()]
    for fault in faults:
        sys.stderr.write(f"{fault}\n")
    sys.stdout.write(f"docs-check: {len(CHECKS)} checks, {len(faults)} faults\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
