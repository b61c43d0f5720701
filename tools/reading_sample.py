"""Print random names and docstrings of the code, to judge whether a stranger understands them.

    python -m tools.reading_sample --seed 7 --count 30 src climb gym/src

A name needs a change if a reader must open another file to understand it.
"""

from __future__ import annotations

import argparse
import ast
import random
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


@dataclass(frozen=True)
class Sample:
    """A name, or the first paragraph of a docstring, and the location of its definition."""

    location: str
    text: str


def names(root: Path) -> Iterator[Sample]:
    """Yield the functions, classes, parameters and fields defined in a folder's Python files."""
    for path, node in _definitions(root):
        location = f"{path}:{node.lineno}"
        yield Sample(location, node.name)
        if isinstance(node, ast.ClassDef):
            fields = (part for part in node.body if isinstance(part, ast.AnnAssign))
            for part in fields:
                if isinstance(part.target, ast.Name):
                    yield Sample(f"{path}:{part.lineno}", f"{node.name}.{part.target.id}")
        else:
            for argument in [*node.args.args, *node.args.kwonlyargs]:
                if argument.arg not in ("self", "cls"):
                    yield Sample(location, f"{node.name}({argument.arg})")


def docstrings(root: Path) -> Iterator[Sample]:
    """Yield the first paragraph of each docstring in a folder's Python files, after its name."""
    for path, node in _definitions(root):
        text = ast.get_docstring(node)
        if text:
            first = " ".join(text.split("\n\n")[0].split())
            yield Sample(f"{path}:{node.lineno}", f"{node.name}: {first}")


def _definitions(root: Path) -> Iterator[tuple[Path, Definition]]:
    for path in sorted(root.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, Definition):
                yield path, node


def main() -> None:
    """Print samples from the folders on the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=30)
    args = parser.parse_args()
    draw = random.Random(args.seed)
    for title, find in (("Names", names), ("Docstrings", docstrings)):
        found = [sample for folder in args.folders for sample in find(folder)]
        sys.stdout.write(f"{title}: {args.count} of {len(found)}\n")
        for sample in draw.sample(found, min(args.count, len(found))):
            sys.stdout.write(f"  {sample.text}    [{sample.location}]\n")


if __name__ == "__main__":
    main()
