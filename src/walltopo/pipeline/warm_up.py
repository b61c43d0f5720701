"""Compiling the kernels of a scan while its first stages run, in a process of its own.

numba compiles a kernel when it is first called, which on a new machine costs the stages dense to
lift half a minute. Which kernels a scan calls, with which types, stands in `kernels.txt`
(`python -m walltopo_lab.benchmarks.cold --record` writes it). The child compiles them in that order
at low priority into numba's cache on disk; the scan finds there what is ready and compiles the
rest itself. On a machine that has them all, the child loads them and ends.
"""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from walltopo.core.children import child_process, end_with_parent, python_module

# Lines `module function signature`, in the order in which a scan calls them.
TABLE = Path(__file__).with_name("kernels.txt")

_ARRAY = re.compile(r"(readonly )?array\((\w+), (\d)d, ([CFA])\)")
_REPEATED = re.compile(r"UniTuple\((\w+) x (\d+)\)")


@contextmanager
def warming_up() -> Iterator[None]:
    """While this is open, a child compiles kernels; it ends with it at the latest."""
    # Whatever goes wrong in it, the scan compiles by itself, and reports that.
    with child_process(python_module("walltopo.pipeline.warm_up")):
        yield


def compile_line(line: str) -> None:
    """Compile one kernel of the table, or load it where it is on disk.

    Raises
    ------
    ImportError, AttributeError : no such kernel; ValueError : a signature of a kind unknown here.
    """
    module, function, signature = line.split(" ", 2)
    getattr(importlib.import_module(module), function).compile(_types(signature))


def _types(signature: str) -> Any:
    """numba's types of a signature as numba prints it."""
    from numba import types

    def array(found: re.Match[str]) -> str:
        frozen, item, axes, layout = found.groups()
        return f"Array({item}, {axes}, '{layout}', readonly={frozen is not None})"

    text = _ARRAY.sub(array, signature.replace("bool,", "boolean,"))
    text = _REPEATED.sub(r"UniTuple(\1, \2)", text)
    try:
        # Of a file of the package's own.
        return eval(text, {"__builtins__": {"True": True, "False": False}}, vars(types))
    except (SyntaxError, NameError, TypeError) as error:
        raise ValueError(f"signature {signature!r}: {error}") from error


def _main() -> None:
    end_with_parent()
    if hasattr(os, "nice"):
        os.nice(10)
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        # One that cannot be compiled is compiled, or told, by the scan.
        with suppress(Exception):
            compile_line(line)


if __name__ == "__main__":
    _main()
