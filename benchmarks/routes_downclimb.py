"""Are downclimb holds found by themselves? On gyms of the generator, set but not photographed.

    python -m benchmarks.routes_downclimb choose     other values of the rule, on gyms 3000 to 3029
    python -m benchmarks.routes_downclimb report     the rule, on gyms 1000 to 1029

Colours are true; a type is told for six of ten holds (as the model of shapes does on another
generator's holds) and one in eight of those is wrong.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from benchmarks.routes_gyms import set_gym
from walltopo.routes import downclimb
from walltopo.routes.records import Hold

PRESETS = ("modern", "oldschool-dark", "lead", "modern", "easy")
TOLD, WRONG = 0.6, 0.125
TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")


def as_seen(holds: list[Hold], seed: int) -> list[Hold]:
    """The holds with types as a scan would have them."""
    rng = np.random.default_rng([17, seed])
    seen = []
    for hold in holds:
        name = hold.type if rng.random() > WRONG else str(rng.choice(TYPES))
        seen.append(replace(hold, type=name if rng.random() < TOLD else "unknown"))
    return seen


def count(gyms: list[tuple[list[Hold], list[Hold]]]) -> str:
    """How many downclimb holds are found, and how many others are taken for some."""
    there = found = false = 0
    for holds, seen in gyms:
        colours = downclimb.downclimb_colours(seen, 1.0)
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
    for name, values in {"JUGS": (0.34, 0.5, 0.67), "LARGE": (1.0, 1.2), "ALONE": (3, 6)}.items():
        kept = getattr(downclimb, name)
        for value in values:
            setattr(downclimb, name, value)
            print(f"{name} = {value}: {count(gyms)}")
        setattr(downclimb, name, kept)


if __name__ == "__main__":
    main()
