"""Print the changes of a reset: routes kept, changed, removed and new, and the holds of each.

python examples/compare_resets.py OLD NEW

Both scans stand in one frame: NEW was scanned with `--reference OLD`.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

from walltopo.describe.matching.inventory import changes, load_scan
from walltopo.describe.matching.routes import compare_routes
from walltopo.scans.routes import Routes


def main(old_scan: Path, new_scan: Path) -> None:
    old, old_holds, *_ = load_scan(old_scan)
    new, new_holds, *_ = load_scan(new_scan)
    fates = Counter(change.what for change in changes(old_holds, new_holds))
    print("holds:", ", ".join(f"{count} {what}" for what, count in sorted(fates.items())))
    before = {route.id: route for route in Routes.load(old.routes).routes}
    after = {route.id: route for route in Routes.load(new.routes).routes}
    lines = compare_routes(
        {number: route.holds for number, route in before.items()},
        old_holds,
        {number: route.holds for number, route in after.items()},
        new_holds,
    )
    for line in lines:
        route = after[line.number] if line.number is not None else before[line.route or 0]
        holds = f"+{len(line.added)} -{len(line.removed)}, {len(line.moved)} moved"
        print(f"{line.status:>8}: {route.name or route.id} ({route.colour}), holds {holds}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python examples/compare_resets.py OLD NEW")
    main(Path(sys.argv[1]), Path(sys.argv[2]))
