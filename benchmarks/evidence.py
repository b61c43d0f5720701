"""Precision and recall of holds from masks, relief and colour; fits `models/evidence.json`.

    python -m benchmarks.evidence SCAN GYM [SCAN GYM ...] [-o FILE]

Each SCAN has a mesh and detections of the photos of GYM, a folder of `walltopo synth`. The output
for each gym: precision and recall of the shown holds by masks alone, and by a model fitted on the
other gyms. FILE gets the model fitted on all gyms.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.describe.settings import ClassifySettings
from walltopo.segment.propose.evidence import CUES, EvidenceModel
from walltopo_lab.train.evidence import Samples, fit_model, prepare_scan, samples_of


def _row(title: str, model: EvidenceModel, samples: Samples) -> None:
    settings = ClassifySettings()
    chance = model.probability(samples.cues)
    together = (chance >= settings.min_evidence) & samples.explained
    masked = samples.cues[:, CUES.index("masks")] > 0
    alone = samples.cues[:, CUES.index("support")] >= np.sqrt(settings.min_score)
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
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="SCAN GYM")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    gyms = {pair[1].name: samples_of(prepare_scan(*pair)) for pair in _pairs(args.folders)}
    print(
        "| gym | pieces | holds | masks alone: precision / recall | together | holds without any mask: shown | false ones without |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, samples in gyms.items():
        others = [own for other, own in gyms.items() if other != name]
        _row(name, fit_model(Samples.together(others)), samples)
    made_by = f"python -m benchmarks.evidence, gyms {', '.join(gyms)}"
    model = fit_model(Samples.together(list(gyms.values())), made_by)
    if args.output:
        model.save(args.output)
    print("\n| cue | weight with masks | without |")
    print("|---|---|---|")
    both = zip(CUES, model.masked.weights, model.unmasked.weights, strict=True)
    for name, masked, unmasked in both:
        print(f"| {name} | {masked:+.2f} | {unmasked:+.2f} |")


if __name__ == "__main__":
    main()
