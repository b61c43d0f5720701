"""The build back end of walltopo-gym: setuptools, and in a checkout the web app first."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

_TOOLS = Path(__file__).resolve().parents[1] / "tools"


def _backend() -> Any:
    if not (_TOOLS / "web_build.py").is_file():  # a source archive, which carries the app
        from setuptools import build_meta

        return build_meta
    sys.path.insert(0, str(_TOOLS))
    from web_build import BUNDLES, Backend

    return Backend(BUNDLES["app"])


BACKEND = _backend()
