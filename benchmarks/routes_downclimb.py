"""Detection of downclimb holds, on generated gyms that are set but not photographed.

    python -m benchmarks.routes_downclimb choose     other values of the rule, on gyms 3000 to 3029
    python -m benchmarks.routes_downclimb report     the rule, on gyms 1000 to 1029

Colours are true. Types are confused as by the shipped network on lifted instances: each is drawn
from the network's answers for that type on two reconstructed gyms (`python -m
benchmarks.types scans`).
"""

from __future__ import annotations

import sys

import numpy as np
from msgspec.structs import replace

from walltopo.describe.classify import attributes
from walltopo.scans.holds import Hold
from walltopo_lab.synth.set_gyms import CALLED, PRESETS, set_gym


def as_seen(holds: list[Hold], seed: int) -> list[Hold]:
    """Return the holds with types as confused as a scan's."""
    rng = np.random.default_rng([17, seed])
    seen = []
    for hold in holds:
        counts = CALLED[hold.type]
        odds = np.array(list(counts.values())) / sum(counts.values())
        seen.append(replace(hold, type=str(rng.choice(list(counts), p=odds))))
    return seen


def count(gyms: list[tuple[list[Hold], list[Hold]]]) -> str:
    """Return the number of downclimb holds found, and of other holds mistaken for them."""
    there = found = false = 0
    for holds, seen in gyms:
        colours = attributes.downclimb_colours(seen, 1.0)
        there += sum(hold.role == "downclimb" for hold in holds)
        found += sum(hold.role == "downclimb" and hold.colour in colours for hold in holds)
        false += sum(hold.role == "hold" and hold.colour in colours for hold in holds)
    total = sum(len(holds) for holds, _ in gyms)
    return (
        f"{found} of {there} downclimb holds found; {false} of {total - there} others taken for it"
    )


def main() -> None:
    if sys.argv[1:] not in (["choose"], ["report"]):
        raise SystemExit(__doc__)
    first = 3000 if sys.argv[1] == "choose" else 1000
    gyms = []
    for number in range(30):
        holds = set_gym(PRESETS[number % len(PRESETS)], first + number).holds
        gyms.append((holds, as_seen(holds, first + number)))
    print(f"the rule: {count(gyms)}")
    if sys.argv[1] == "report":
        return
    for name, values in {
        "JUGS": (0.25, 0.34, 0.5),
        "OTHERS": (0.0, 0.34),
        "LARGE": (1.0, 1.2),
        "ALONE": (3, 6),
    }.items():
        kept = getattr(attributes, name)
        for value in values:
            setattr(attributes, name, value)
            print(f"{name} = {value}: {count(gyms)}")
        setattr(attributes, name, kept)


if __name__ == "__main__":
    main()
