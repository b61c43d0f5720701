"""Holds that turned, moved or went between two scans of generated gyms that chose nothing.

    python -m benchmarks.loose_holds FOLDER [--seeds 6401 6402 ...]

Makes the gyms of 5 x 4 m in FOLDER where they are missing, the same gyms after wear (some holds
turned by 5 to 90 degrees, shifted by 1 to 5 cm, or gone), 24 other photos of 1280 x 960 of each,
and their scans. A turned hold counts from 15 degrees on; the error is the median of those found.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path

from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.scans.folder import ScanFolder
from walltopo_lab.evaluate.loose import HoldRow, compare_scans, loose_figures
from walltopo_lab.synth.params import gym_preset
from walltopo_lab.synth.recipe import Recipe, generate

KINDS = ("modern", "easy")  # presets of even and odd seeds
SEEDS = (6401, 6402)


def recipes_of(seed: int) -> tuple[Recipe, Recipe]:
    """Return the recipes of a gym, and of the same gym after wear."""
    kind = KINDS[seed % len(KINDS)]
    gym, photos = gym_preset(kind)
    gym = dataclasses.replace(gym, width=5.0, height=4.0, routes=8)
    photos = dataclasses.replace(photos, photos=24, width=1280, height=960)
    first = Recipe(gym, photos, seed, kind)
    return first, dataclasses.replace(first, photo_seed=seed, wear_seed=seed)


def measure(folder: Path, seed: int) -> list[HoldRow]:
    """Return a row for each hold of a gym; gyms and scans that the folder has are kept."""
    first, later = recipes_of(seed)
    gyms = folder / f"{seed}", folder / f"{seed}-later"
    scans = folder / f"{seed}-scan", folder / f"{seed}-later-scan"
    settings: list[str] = []
    for recipe, gym, out in zip((first, later), gyms, scans, strict=True):
        generate(gym, recipe)
        if not ScanFolder(out).holds.is_file():
            scan(gym / "photos", out, load_settings(None, settings))
        settings = [f"sparse.reference={scans[0]}"]
    return compare_scans(*scans, *gyms)


def row_of(name: str, rows: Sequence[HoldRow]) -> str:
    """Return a row of the table."""
    of = loose_figures(rows)
    return (
        f"| {name} | {of['turned_found']} of {of['turned']} | {of['turn_error_median_deg']} "
        f"| {of['turned_less_found']} of {of['turned_less']} | {of['moved_found']} of {of['moved']} "
        f"| {of['gone_found']} of {of['gone']} | {of['false_alarms']} of {of['untouched']} |"
    )


def main(words: Sequence[str] | None = None) -> None:
    """Print a row for each gym, and one for all holds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    args = parser.parse_args(words)
    print("| gym | turned | error, degrees | turned less | moved | gone | false alarms |")
    print("|---|---|---|---|---|---|---|")
    everything: list[HoldRow] = []
    for seed in args.seeds:
        rows = measure(args.folder, seed)
        everything += rows
        print(row_of(f"{KINDS[seed % len(KINDS)]}, seed {seed}", rows), flush=True)
    print(row_of("all", everything))


if __name__ == "__main__":
    main()
