"""The whole pipeline as a library: photos in, holds and routes out.

python examples/scan_photos.py examples/demo-photos demo-scan texture.size=2048
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import walltopo
from walltopo.core.files import read_json


def main(photos: Path, out: Path, given: Sequence[str]) -> None:
    # Any setting of `walltopo settings`, with the same checks as on the command line.
    settings = walltopo.load_settings(None, given)
    result = walltopo.scan(photos, out, settings)
    print("computed now:", ", ".join(result.ran) or "nothing, all was up to date")

    holds = {hold["id"]: hold for hold in read_json(result.folder.holds)["holds"]}
    for route in read_json(result.folder.routes)["routes"]:
        kinds = [holds[i]["type"] for i in route["holds"] if i in holds]
        print(f"route {route['id']}: {route['colour']}, {len(kinds)} holds, bottom to top: {kinds}")
    print("open", result.folder.page)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit("usage: python examples/scan_photos.py PHOTOS SCAN [KEY=VALUE ...]")
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
