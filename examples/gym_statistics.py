"""A gym in figures: holds by colour and type, routes by steepness and length, as CSV.

python examples/gym_statistics.py SCAN [SCAN ...] > gym.csv

One line a route and wall; holds without a route are in the last line of their wall.
"""

from __future__ import annotations

import csv
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from walltopo.scans.holds import Hold, Holds
from walltopo.scans.routes import Routes

COLUMNS = ("wall", "route", "colour", "holds", "length_m", "steepness_deg", "kinds")


def main(scans: Iterable[Path]) -> None:
    table = csv.writer(sys.stdout)
    table.writerow(COLUMNS)
    for scan in scans:
        holds = {hold.id: hold for hold in Holds.load(scan / "holds.json").holds}
        routes = Routes.load(scan / "routes.json")
        for route in routes.routes:
            figures = (len(route.holds), f"{route.length:.2f}", f"{route.steepness_deg:.0f}")
            kinds = _kinds(holds[number] for number in route.holds)
            table.writerow((scan.name, route.name or route.id, route.colour, *figures, kinds))
        rest = [holds[number] for number in routes.unrouted if number in holds]
        table.writerow((scan.name, "", "", len(rest), "", "", _kinds(rest)))


def _kinds(holds: Iterable[Hold]) -> str:
    """Such as "5 jug, 2 crimp"."""
    counted = Counter(hold.type for hold in holds).most_common()
    return ", ".join(f"{count} {kind}" for kind, count in counted)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: python examples/gym_statistics.py SCAN [SCAN ...]")
    main(Path(word) for word in sys.argv[1:])
