"""Compile the kernels of a scan in a child process while the first stages run.

numba compiles a kernel at its first call, which costs half a minute on a new machine. The file
`kernels.txt` lists the kernels of a scan and their types; `python -m benchmarks.cold
--record` writes it. The child compiles them in that order at low priority into numba's disk cache.
The scan uses the cached kernels and compiles the rest itself.
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
    """Compile kernels in a child process during the block; kill the child at the end."""
    # Errors of the child are ignored: the scan compiles the kernel itself and reports the error.
    with child_process(python_module("walltopo.pipeline.warm_up")):
        yield


def compile_line(line: str) -> None:
    """Compile one kernel of the table, or load it from the cache.

    Raises
    ------
    ImportError, AttributeError : unknown kernel.
    ValueError : unsupported signature.
    """
    module, function, signature = line.split(" ", 2)
    getattr(importlib.import_module(module), function).compile(_signature_types(signature))


def _signature_types(signature: str) -> Any:
    """Return numba's types of a signature in numba's notation."""
    from numba import types

    def array(found: re.Match[str]) -> str:
        frozen, item, axes, layout = found.groups()
        return f"Array({item}, {axes}, '{layout}', readonly={frozen is not None})"

    text = _ARRAY.sub(array, signature.replace("bool,", "boolean,"))
    text = _REPEATED.sub(r"UniTuple(\1, \2)", text)
    try:
        # `eval` is safe here: the text comes from a file of this package.
        return eval(text, {"__builtins__": {"True": True, "False": False}}, vars(types))
    except (SyntaxError, NameError, TypeError) as error:
        raise ValueError(f"signature {signature!r}: {error}") from error


def _main() -> None:
    end_with_parent()
    if hasattr(os, "nice"):
        os.nice(10)
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        # If a kernel fails here, the scan compiles it and reports the error.
        with suppress(Exception):
            compile_line(line)


if __name__ == "__main__":
    _main()
