"""Hide from walltopo's modules what only Linux or Unix has, in this process and its children.

Python imports this module at its start, from a folder on PYTHONPATH. Libraries keep everything:
whether they run on a system is what their wheels say.
"""

from __future__ import annotations

import builtins
import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

MODULES = ("fcntl", "grp", "prctl", "pwd", "resource", "termios")
FUNCTIONS = ("fork", "forkpty", "killpg", "sched_getaffinity", "set_blocking", "setsid")
FILES = ("/proc/", "/sys/", "/dev/shm")

_import = builtins.__import__
_STANDARD = os.path.dirname(os.__file__)
_PACKAGE = f"{os.sep}walltopo{os.sep}"


def _import_some(
    name: str,
    globals: Mapping[str, Any] | None = None,
    locals: Mapping[str, Any] | None = None,
    fromlist: Sequence[str] | None = (),
    level: int = 0,
) -> ModuleType:
    importer = str((globals or {}).get("__name__", ""))
    if name in MODULES and importer.partition(".")[0] == "walltopo":
        raise ImportError(f"{importer}: no {name} on this system")
    return _import(name, globals, locals, fromlist or (), level)


def _refuse_files(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and str(arguments[0]).startswith(FILES) and _is_opened_by_walltopo():
        raise FileNotFoundError(2, "no such file on this system", arguments[0])


def _is_opened_by_walltopo() -> bool:
    """Return whether the innermost frame outside the standard library is walltopo's."""
    frame = sys._getframe(1)
    while frame is not None:
        file = frame.f_code.co_filename
        if file != __file__ and not file.startswith("<") and os.path.dirname(file) != _STANDARD:
            return _PACKAGE in file
        frame = frame.f_back  # type: ignore[assignment]
    return False


builtins.__import__ = _import_some
sys.addaudithook(_refuse_files)
for _name in FUNCTIONS:
    if hasattr(os, _name):
        delattr(os, _name)
# Windows' own encoding is not UTF-8; set PYTHONWARNDEFAULTENCODING for this warning.
warnings.filterwarnings("error", category=EncodingWarning, module=r"walltopo\b")
