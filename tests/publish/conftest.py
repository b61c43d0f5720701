"""The fixture that writes a small scan folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_scan import build_scan  # type: ignore[import-not-found]

from walltopo.scans.folder import ScanFolder


@pytest.fixture
def make_scan(tmp_path: Path) -> Callable[..., ScanFolder]:
    """`make_scan(holds=12, ...)` writes a scan folder under the test's own folder."""

    def make(name: str = "scan", **options: Any) -> ScanFolder:
        scan: ScanFolder = build_scan(tmp_path / name, **options)
        return scan

    return make
