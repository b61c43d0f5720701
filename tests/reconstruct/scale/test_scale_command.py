"""`walltopo measure`: the commands, without the rest of the command line."""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
import pytest

from walltopo.cli import measure
from walltopo.core import SettingsError
from walltopo.reconstruct.scale.plates import BUILT_IN


def walltopo(*words: str) -> int:
    parser = argparse.ArgumentParser()
    measure.register(parser.add_subparsers(required=True))
    args = parser.parse_args(["measure", *words])
    code: int = args.run(args)
    return code


def test_print_writes_a_pdf(tmp_path: Path) -> None:
    out = tmp_path / "plates" / "plate ü.pdf"
    assert walltopo("print", "-o", str(out), "--paper", "a3", "--number", "3") == 0
    pdf = out.read_bytes()
    assert pdf.startswith(b"%PDF-1.4")
    assert b"ids 44, 45, 46, 47" in pdf


def test_print_refuses_a_number_there_is_not(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="expected 1 to 3, got 5"):
        walltopo("print", "-o", str(tmp_path / "p.pdf"), "--number", "5")
    assert not (tmp_path / "p.pdf").exists()


def test_print_takes_a_plate_of_ones_own(tmp_path: Path) -> None:
    toml = tmp_path / "own.toml"
    toml.write_text(
        '[[plate]]\nname = "small"\ndictionary = "DICT_5X5_100"\nids = [90, 91, 92, 93]\n'
        "size = [0.2, 0.2]\nmarker = 0.06\nmargin = 0.01\n",
        encoding="utf-8",
    )
    assert walltopo("print", "-o", str(tmp_path / "p.pdf"), "--plates", str(toml)) == 0
    assert b"DICT_5X5_100, ids 90, 91, 92, 93" in (tmp_path / "p.pdf").read_bytes()


def test_detect_lists_the_markers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    photo = np.pad(cv2.aruco.generateImageMarker(table, 21, 60), 40, constant_values=230)
    cv2.imwrite(str(tmp_path / "a.png"), photo)
    cv2.imwrite(str(tmp_path / "b.png"), np.full((90, 90), 128, np.uint8))
    assert walltopo("detect", str(tmp_path)) == 0
    output = capsys.readouterr().out
    assert "a4 20-23" in output
    assert "in 1 photo(s) (take at least 3)" in output
    assert walltopo("detect", str(tmp_path / "b.png")) == 0
    assert "found no plate" in capsys.readouterr().out


def test_plates_gives_the_built_in_toml(capsys: pytest.CaptureFixture[str]) -> None:
    assert walltopo("plates") == 0
    assert capsys.readouterr().out == BUILT_IN
