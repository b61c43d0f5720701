"""The OpenAPI document as a file, of which the web app's client is made.

python -m walltopo_gym.api.document FILE
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from walltopo.core.files import atomic_path
from walltopo_gym.api.app import build_app
from walltopo_gym.api.services import Services
from walltopo_gym.settings import load_settings


def write_document(path: Path) -> None:
    """Write what `/api/v1/openapi.json` answers."""
    with TemporaryDirectory() as folder:
        services = Services.open(load_settings({"data": folder}, {}))
        try:
            document = build_app(services).openapi()
        finally:
            services.database.close()
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_document(Path(sys.argv[1]))
