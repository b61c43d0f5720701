"""Let a package be called like the function it is named after.

`walltopo.lift(...)` and `from walltopo.lift import LiftParams` must both work, but importing a
submodule binds its name on the package and would hide a function of that name. A module whose
class has `__call__` serves both, whichever comes first.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

__all__ = ["make_callable"]


def make_callable(module_name: str, target: str) -> None:
    """Make module `module_name` callable; calls go to `target` ("package.module:function").

    The target is imported at the first call, so that importing the package stays light.
    """
    target_module, _, target_name = target.partition(":")

    class _Callable(ModuleType):
        def __call__(self, *args: Any, **kwargs: Any) -> Any:
            function = getattr(importlib.import_module(target_module), target_name)
            return function(*args, **kwargs)

    sys.modules[module_name].__class__ = _Callable
