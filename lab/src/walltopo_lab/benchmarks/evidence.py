"""How well masks, relief and colour together tell holds; fits `models/evidence.json`.

    python -m walltopo_lab.benchmarks.evidence SCAN GYM [SCAN GYM ...] --choose SCAN GYM [...] -o FILE

Each SCAN has a mesh and detections of the photos of GYM, a folder of `walltopo synth`. The model is
fitted on the first ones; printed for those under `--choose`, which fit nothing, and all others:
precision and recall of what is shown by masks alone and by all together. Without `-o` the shipped
model is asked.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.holds.contract import ClassifySettings
from walltopo.propose.evidence import CUES, EvidenceModel, shipped_model
from walltopo_lab.train.evidence import Samples, fit, prepare, samples_of


def _row(title: str, model: EvidenceModel, samples: Samples) -> None:
    settings = ClassifySettings()
    chance = model.probability(samples.cues)
    together = (chance >= settings.least_evidence) & samples.explained
    masked = samples.cues[:, CUES.index("masks")] > 0
    alone = samples.cues[:, CUES.index("support")] >= np.sqrt(settings.least_score)
    holds = samples.hold
    unmasked = f"{int((together & holds & ~masked).sum())} of {int((holds & ~masked).sum())}"
    false = int((together & ~holds & ~masked).sum())
    print(
        f"| {title} | {len(holds)} | {int(holds.sum())} | {_shares(alone, holds)} | "
        f"{_shares(together, holds)} | {unmasked} | {false} |"
    )


def _shares(shown: NDArray[np.bool_], holds: NDArray[np.bool_]) -> str:
    hits = int((shown & holds).sum())
    return f"{hits / max(int(shown.sum()), 1):.3f} / {hits / max(int(holds.sum()), 1):.3f}"


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
    print(
        "| gym | pieces | holds | masks alone: precision / recall | together | holds without any mask: shown | false ones without |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, samples in (own | others).items():
        _row(f"{name}{', fitted on' if name in own and args.output else ''}", model, samples)
    print("| cue | weight |")
    print("|---|---|")
    for name, weight in zip(CUES, model.weights, strict=True):
        print(f"| {name} | {weight:+.2f} |")


if __name__ == "__main__":
    main()
