"""The folder in which another program computes a mesh."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def work_folder(backend: str, cache: Path) -> Iterator[Path]:
    """Yield an empty folder in `cache`; delete it unless an error left the block."""
    work = Path(tempfile.mkdtemp(prefix=f"{backend}-", dir=cache))
    yield work
    # After an error the folder stays, because it holds the logs.
    shutil.rmtree(work)
