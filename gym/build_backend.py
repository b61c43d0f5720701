"""The build back end of walltopo-gym: setuptools, and in a checkout the web app first."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

_TOOLS = Path(__file__).resolve().parents[1] / "tools"


def _backend() -> Any:
    if not (_TOOLS / "web_build.py").is_file():  # a source archive, which carries the app
        from setuptools import build_meta

        return build_meta
    sys.path.insert(0, str(_TOOLS))
    web_build = import_module("web_build")
    return web_build.Backend(web_build.BUNDLES["app"])


BACKEND = _backend()
