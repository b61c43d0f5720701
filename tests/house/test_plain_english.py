"""Docstrings, comments, names and locale keys avoid a short list of unclear constructions."""

from __future__ import annotations

import ast
import io
import json
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UNITS = ("src", "features", "climb", "lab", "gym", "tests", "examples", "viewer")
SENTENCES = re.compile(
    r"\btold\b"
    r"|\b[Ww]hoever\b"
    r"|(?:^|[.:;] )Who "  # as a subject: "Who has no account ..."
    r"|(?:^|\. )(?:Of the|What is) "
    r"|\bThat which\b"
    r"|\b(?:is|are) (?:asked|said)\b"
    r"|\bfor who\b"
    r"|\bthat is none\b"
    r"|\bwhere there is (?:one|none)\b",
    re.MULTILINE,
)
# A text and each of its sentences begin with a main clause or a noun: not "What is left of it."
# Inside a text "Where holds overlap, the nearest one counts." is allowed.
BEGINNING = re.compile(
    r"\A(?:What|Where|Whose|Which|Of) [^A-Z]|[.:;]\s+(?:What|Whose|Which|Of) [^A-Z]"
)
NAMES = {
    "told",
    "said",
    "asked",
    "whoever",
    "shelf",
    "shelve",
    "desk",
    "surety",
    "surest",
    "occasions",
}
APPS = ("viewer/src", "gym/web/src")
GENERATED = {"gym/web/src/api/schema.d.ts", "viewer/src/data/wire.ts"}
KEYS = {"told", "untold", "asked", "asking"}
# A comment of TypeScript, CSS or Svelte's markup; `accept="image/*"` begins no comment.
APP_COMMENT = re.compile(
    r"(?:(?<=[\s({\[,;])|^)(?:/\*+(?P<block>.*?)\*/|//(?P<line>[^\n]*(?:\n\s*//[^\n]*)*))"
    r"|<!--(?P<markup>.*?)-->",
    re.DOTALL | re.MULTILINE,
)


def _texts(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and text of each docstring and each block of comment lines."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield node.body[0].lineno, text
    block: list[tuple[int, int, str]] = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            (line, column), text = token.start, token.string[1:].strip()
            alone = not token.line[:column].strip()
            if block and not (alone and block[-1][:2] == (line - 1, column)):
                yield _joined(block)
                block = []
            block.append((line, column if alone else -1, text))
    if block:
        yield _joined(block)


def _joined(block: list[tuple[int, int, str]]) -> tuple[int, str]:
    return block[0][0], "\n".join(text for _, _, text in block)


def _app_texts(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and text of each comment of a TypeScript or Svelte file."""
    for match in APP_COMMENT.finditer(source):
        text = match["block"] or match["line"] or match["markup"] or ""
        lines = (re.sub(r"^\s*(?:\*(?!/)|//)?\s*", "", line) for line in text.splitlines())
        yield source.count("\n", 0, match.start()) + 1, "\n".join(lines).strip()


def _faults(place: str, texts: Iterator[tuple[int, str]]) -> list[str]:
    """Return the banned constructions in the texts of one file."""
    return [
        f"{place}:{line}: {match.group()!r} in {text[:90]!r}"
        for line, text in texts
        for match in (*SENTENCES.finditer(text), *BEGINNING.finditer(text))
    ]


def _names(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and name of each identifier."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME:
            yield token.start[0], token.string


def _files(unit: str) -> list[Path]:
    return [path for path in (ROOT / unit).rglob("*.py") if "node_modules" not in path.parts]


@pytest.mark.parametrize("unit", UNITS)
def test_sentences_have_a_subject(unit: str) -> None:
    found = [
        fault
        for path in _files(unit)
        if path != Path(__file__)
        for fault in _faults(str(path.relative_to(ROOT)), _texts(path.read_text(encoding="utf-8")))
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("app", APPS)
def test_sentences_of_the_apps_have_a_subject(app: str) -> None:
    found: list[str] = []
    for path in (path for ending in ("ts", "svelte") for path in (ROOT / app).rglob(f"*.{ending}")):
        place = path.relative_to(ROOT).as_posix()
        if place not in GENERATED:
            found += _faults(place, _app_texts(path.read_text(encoding="utf-8")))
    assert not found, "\n".join(found)


def test_comments_of_the_apps_are_found() -> None:
    source = (
        "/** Return the wall. */\nlet a = 'https://x'; // One.\n  // Two\n  // three.\n"
        '<input accept="image/*"> <!-- Four. -->\n/*\n * Five\n * six.\n */\n'
    )
    found = list(_app_texts(source))
    assert found == [
        (1, "Return the wall."),
        (2, "One.\nTwo\nthree."),
        (5, "Four."),
        (6, "Five\nsix."),
    ]


@pytest.mark.parametrize("app", APPS)
def test_keys_of_texts_say_what_they_are(app: str) -> None:
    files = [path for path in (ROOT / app).rglob("*.json") if path.parent.name == "locales"]
    files += (ROOT / app / "languages").glob("*.ts")
    assert files
    found = [
        f"{path.relative_to(ROOT)}: {key}"
        for path in files
        for key in _keys(path)
        if KEYS & set(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", key).lower().split("_"))
    ]
    assert not found, "\n".join(found)


def _keys(path: Path) -> list[str]:
    """Return the keys of a locale file, those of inner tables too."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ts":
        return re.findall(r"(?:^|[{,])\s*(\w+)\??: ", text, re.MULTILINE)
    keys: list[str] = []
    json.loads(text, object_pairs_hook=lambda pairs: keys.extend(key for key, _ in pairs))
    return keys


@pytest.mark.parametrize("unit", UNITS)
def test_names_say_what_they_are(unit: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in _files(unit)
        for line, name in _names(path.read_text(encoding="utf-8"))
        if NAMES & set(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower().split("_"))
    ]
    assert not found, "\n".join(found)
