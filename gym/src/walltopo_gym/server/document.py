"""The OpenAPI document as a file, from which the web app's client is generated.

python -m walltopo_gym.server.document FILE
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from walltopo.core.files import atomic_path
from walltopo_gym.server.app import build_app, open_services
from walltopo_gym.settings import load_settings


def write_document(path: Path) -> None:
    """Write the response of `/api/v1/openapi.json` to a file."""
    with TemporaryDirectory() as folder:
        services = open_services(load_settings({"data": folder}, {}))
        try:
            document = build_app(services).openapi()
        finally:
            services.database.close()
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_document(Path(sys.argv[1]))
