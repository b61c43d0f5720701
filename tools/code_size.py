"""Count the code of a package: `python -m tools.code_size src/walltopo`.

Lines of code are lines with a token that is neither a comment nor part of a docstring.
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from collections import Counter
from pathlib import Path

_NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def code_lines(source: str) -> int:
    """Return the number of lines with code in a Python source."""
    documented: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        if ast.get_docstring(node, clean=False) is not None:
            text = node.body[0]
            documented.update(range(text.lineno, (text.end_lineno or text.lineno) + 1))
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _NO_CODE:
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines - documented)


def main(folder: Path) -> None:
    """Print the lines of code and the files of each package of a folder, and the totals."""
    lines: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for path in sorted(folder.rglob("*.py")):
        package = path.relative_to(folder).parts[0]
        lines[package] += code_lines(path.read_text(encoding="utf-8"))
        files[package] += 1
    for package, count in lines.most_common():
        sys.stdout.write(f"{package:16s} {count:6,d} lines {files[package]:4d} files\n")
    total, number = sum(lines.values()), sum(files.values())
    sys.stdout.write(f"{'all':16s} {total:6,d} lines {number:4d} files\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
