"""COLMAP models that are cut, damaged or hostile are refused before COLMAP reads them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from walltopo.core import InputError
from walltopo.geometry.colmap import pycolmap
from walltopo.scans import colmap_model as model_files
from walltopo.scans.colmap_model import open_model, read_views

FILES = ("cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin")


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """A small whole model, binary, with points."""
    pycolmap.set_random_seed(0)
    options = pycolmap.SyntheticDatasetOptions(
        num_rigs=1, num_cameras_per_rig=2, num_frames_per_rig=2, num_points3D=4
    )
    pycolmap.synthesize_dataset(options).write_binary(tmp_path)
    return tmp_path


def test_a_whole_model_is_read(model: Path) -> None:
    assert len(read_views(model)) == 4


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.95])
def test_a_file_that_was_cut_is_named(model: Path, name: str, share: float) -> None:
    data = (model / name).read_bytes()
    (model / name).write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=rf"{name}: truncated or damaged"):
        open_model(model)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("count", [2**32, 2**63, 2**64 - 1])
def test_a_count_beyond_the_file_is_named(model: Path, name: str, count: int) -> None:
    data = (model / name).read_bytes()
    (model / name).write_bytes(count.to_bytes(8, "little") + data[8:])
    with pytest.raises(InputError, match=name):
        open_model(model)


@pytest.mark.parametrize("name", FILES)
def test_what_comes_after_the_last_entry_is_reported(model: Path, name: str) -> None:
    """A count that is too small would give a smaller model in silence."""
    with (model / name).open("ab") as stream:
        stream.write(b"\0" * 8)
    with pytest.raises(InputError, match=rf"{name}: damaged"):
        open_model(model)


def test_the_table_of_camera_models_is_colmaps() -> None:
    for name, number in pycolmap.CameraModelId.__members__.items():
        if name != "INVALID":
            camera = pycolmap.Camera.create_from_model_id(0, number, 1.0, 1, 1)
            assert len(camera.params) == model_files._PARAMETERS[int(number)], name


def test_an_unknown_camera_model_is_reported(model: Path) -> None:
    data = bytearray((model / "cameras.bin").read_bytes())
    data[12:16] = (99).to_bytes(4, "little")
    (model / "cameras.bin").write_bytes(data)
    with pytest.raises(InputError, match=r"cameras\.bin: camera model 99"):
        open_model(model)


def _text(*swaps: tuple[str, str, str]) -> Callable[[Path], None]:
    """Writes the model as text with changes: file, what, by what."""

    def change(model: Path) -> None:
        whole = pycolmap.Reconstruction(model)
        for name in FILES:
            (model / name).unlink()
        whole.write_text(model)
        for file, old, new in swaps:
            text = (model / file).read_text()
            assert old in text
            (model / file).write_text(text.replace(old, new))

    return change


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (_text(("images.txt", "camera000001", "../../camera")), "leads out"),
        (_text(("images.txt", "camera000001_frame000001", "/etc/x")), "leads out"),
        (_text(("cameras.txt", "SIMPLE_RADIAL", "FISHBOWL")), "model"),
        (_text(("cameras.txt", "SIMPLE_RADIAL 1024", "SIMPLE_RADIAL 99999999")), "too large"),
        (_text(("cameras.txt", "1024 768 1280", "1024 768 -1280")), "focal"),
        (_text(("rigs.txt", "CAMERA 1", "CAMERA 7")), "7"),
    ],
)
def test_text_models_are_held_against_the_same(
    model: Path, change: Callable[[Path], None], named: str
) -> None:
    change(model)
    with pytest.raises(InputError, match=rf"{model}.*{named}"):
        open_model(model)


def test_a_text_model_is_read(model: Path) -> None:
    _text()(model)
    assert len(read_views(model)) == 4


def test_a_name_that_is_not_utf8_is_reported(model: Path) -> None:
    data = (model / "images.bin").read_bytes()
    (model / "images.bin").write_bytes(data.replace(b"camera000001", b"camer\xff000001"))
    with pytest.raises(InputError, match="unreadable COLMAP model"):
        open_model(model)
