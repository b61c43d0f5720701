"""Docstrings, comments and names are plain English, without a few constructions that came back."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
UNITS = ("src", "climb", "lab", "gym", "tests", "examples")
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
NAMES = {"told", "said", "asked", "whoever", "shelf", "desk", "surety"}


def _texts(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and text of each docstring and comment."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield node.body[0].lineno, text
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string[1:].strip()


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
        f"{path.relative_to(ROOT)}:{line}: {match.group()!r} in {text[:90]!r}"
        for path in _files(unit)
        if path != Path(__file__)
        for line, text in _texts(path.read_text(encoding="utf-8"))
        for match in SENTENCES.finditer(text)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("unit", UNITS)
def test_names_say_what_they_are(unit: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in _files(unit)
        for line, name in _names(path.read_text(encoding="utf-8"))
        if NAMES & set(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower().split("_"))
    ]
    assert not found, "\n".join(found)
