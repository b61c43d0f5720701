"""Convert the networks that find and read a climber's pose from MediaPipe's to ONNX.

    npm pack @mediapipe/pose && tar xzf mediapipe-pose-*.tgz
    python -m walltopo_lab.train.pose package climb/src/walltopo_climb/models

The npm package (Apache-2.0) carries the weights of BlazePose. Nothing is trained here.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from walltopo.core import InputError
from walltopo_lab.onnx_file import label_export, save_model
from walltopo_lab.train.pose.convert import convert
from walltopo_lab.train.pose.tflite_file import IDENTIFIER, read_tflite

_ASSETS = "pose_solution_packed_assets.data"
# The landmark network's mask (output 2) and points in metres (output 4) are left out.
_DETECTOR_OUTPUTS = {0: "boxes", 1: "scores"}
_LANDMARK_OUTPUTS = {0: "points", 1: "presence", 3: "heatmaps"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Write `pose_detector.onnx` and `pose_landmarks.onnx` into a folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("package", type=Path, help="the unpacked npm package")
    parser.add_argument("out", type=Path, help="folder of the ONNX files")
    parser.add_argument("--size", choices=("lite", "full", "heavy"), default="heavy")
    args = parser.parse_args(arguments)
    source = _package_name(args.package / "package.json")
    with tempfile.TemporaryDirectory() as folder:
        detector = Path(folder) / "pose_detection.tflite"
        detector.write_bytes(detector_bytes(args.package / _ASSETS))
        convert_file(detector, args.out / "pose_detector.onnx", _DETECTOR_OUTPUTS, source)
    landmarks = args.package / f"pose_landmark_{args.size}.tflite"
    convert_file(landmarks, args.out / "pose_landmarks.onnx", _LANDMARK_OUTPUTS, source)
    return 0


def convert_file(path: Path, out: Path, outputs: dict[int, str], source: str) -> None:
    """Write a TFLite network as ONNX with float16 weights, as TFLite stores them."""
    model = convert(read_tflite(path), path.name, outputs)
    facts = {
        "license": "Apache-2.0",
        "source": f"{path.stem} of {source}",
        "author": "Google LLC (MediaPipe, BlazePose)",
        "changes": "converted from TFLite to ONNX by walltopo; some outputs left out",
    }
    label_export(model, facts)
    save_model(model, out)
    sys.stdout.write(f"{out}: {out.stat().st_size:,} bytes\n")


def detector_bytes(assets: Path) -> bytes:
    """Return the detector, the only TFLite file in the package's packed assets."""
    if not assets.is_file():
        raise InputError(f"{assets}: no such file")
    data = assets.read_bytes()
    start = data.find(IDENTIFIER) - 4
    if start < 0 or data.find(IDENTIFIER, start + 8) >= 0:
        raise InputError(f"{assets}: expected one TFLite file")
    return data[start:]


def _package_name(path: Path) -> str:
    """Return name and version of an npm package."""
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        return f"{about['name']} {about['version']}"
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{path}: not the description of an npm package ({error})") from error


if __name__ == "__main__":
    sys.exit(main())
