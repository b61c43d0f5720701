"""How well masks, relief and colour together tell holds; fits `models/evidence.json`.

    python -m walltopo_lab.benchmarks.evidence SCAN GYM [SCAN GYM ...] --choose SCAN GYM [...] -o FILE

Each SCAN has a mesh and detections of the photos of GYM, a folder of `walltopo synth`. The model is
fitted on the first ones; printed for those under `--choose`, which fit nothing, and all others:
precision and recall of what is shown, and log loss. Without `-o` the shipped model is asked.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from walltopo.propose.evidence import CUES, EvidenceModel, shipped_model
from walltopo_lab.train.evidence import Samples, fit, prepare, samples_of


def _row(title: str, model: EvidenceModel, samples: Samples) -> None:
    chance = model.probability(samples.cues)
    shown = (chance >= 0.5) & samples.explained
    hits, holds = int((shown & samples.hold).sum()), int(samples.hold.sum())
    loss = -np.log(np.maximum(np.where(samples.hold, chance, 1 - chance), 1e-9)).mean()
    print(
        f"| {title} | {len(chance)} | {holds} | {hits / max(int(shown.sum()), 1):.3f} | "
        f"{hits / max(holds, 1):.3f} | {loss:.3f} |"
    )


def _pairs(words: Sequence[Path]) -> list[tuple[Path, Path]]:
    return list(zip(words[::2], words[1::2], strict=True))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="SCAN GYM")
    parser.add_argument("--choose", type=Path, nargs="*", default=[], metavar="SCAN GYM")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    own = {pair[1].name: samples_of(prepare(*pair)) for pair in _pairs(args.folders)}
    others = {pair[1].name: samples_of(prepare(*pair)) for pair in _pairs(args.choose)}
    model = shipped_model()
    if args.output:
        made_by = f"python -m walltopo_lab.benchmarks.evidence, gyms {', '.join(own)}"
        model = fit(Samples.together(list(own.values())), made_by)
        model.save(args.output)
    print("| gym | pieces | holds | precision | recall | log loss |")
    print("|---|---|---|---|---|---|")
    for name, samples in (own | others).items():
        _row(f"{name}{', fitted on' if name in own and args.output else ''}", model, samples)
    print("\nweights of the cues: ", end="")
    print(", ".join(f"{name} {w:+.2f}" for name, w in zip(CUES, model.weights, strict=True)))


if __name__ == "__main__":
    main()
