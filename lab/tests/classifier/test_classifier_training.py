"""From labelled cutouts to an ONNX file that names holds."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import onnx
import pytest
from PIL import Image

from walltopo.cli import main
from walltopo.core import EnvironmentLacksError, InputError, Silent
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds, Role
from walltopo.scans.pictures import INDEX, Cutout, CutoutIndex
from walltopo_lab.classifier import yolo
from walltopo_lab.classifier.cutout_classifier import Meaning, open_classifier, square_cutout
from walltopo_lab.classifier.params import ClassifierSettings
from walltopo_lab.classifier.samples import Cutouts, read_cutouts
from walltopo_lab.classifier.split import hold_split

KINDS = ("bar", "disc", "ring")


def draw(kind: str, rng: np.random.Generator) -> np.ndarray:
    """(40, 40, 4) RGBA cutout of a shape in a random colour."""
    y, x = np.indices((40, 40)) - 19.5
    radius = np.hypot(x, y)
    mask = {
        "bar": (abs(x) < 17) & (abs(y) < 5),
        "disc": radius < 17,
        "ring": (radius < 17) & (radius > 9),
    }[kind]
    picture = np.zeros((40, 40, 4), np.uint8)
    picture[..., :3] = rng.integers(30, 220, 3)
    picture[..., 3] = 255 * mask
    return picture


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    """Eight holds of each of three classes, two cutouts each."""
    rng = np.random.default_rng(0)
    for kind in KINDS:
        (tmp_path / "cutouts" / kind).mkdir(parents=True)
        for hold in range(8):
            for rank in range(2):
                file = tmp_path / "cutouts" / kind / f"{hold:05d}_{rank}.png"
                Image.fromarray(draw(kind, rng)).save(file)
    return tmp_path / "cutouts"


def test_a_folder_per_class(folders: Path) -> None:
    (folders / "classes.toml").write_text('[[class]]\nname = "ring"\ntype = "jug"\n')
    cutouts = read_cutouts([folders], "type", 32)
    assert cutouts.names == KINDS
    assert cutouts.counts() == dict.fromkeys(KINDS, 8)
    assert cutouts.pictures.shape == (48, 32, 32, 3)
    assert cutouts.meanings["ring"].type == "jug"


def test_the_meaning_of_classes_can_be_given(folders: Path) -> None:
    cutouts = read_cutouts([folders], "type", 32).meaning({"disc": Meaning("sloper")})
    assert cutouts.meanings == {"disc": Meaning("sloper")}
    with pytest.raises(InputError, match="blob"):
        cutouts.meaning({"blob": Meaning("sloper")})


def test_holds_are_split_whole_and_each_class_by_the_same_share(folders: Path) -> None:
    cutouts = read_cutouts([folders], "type", 32)
    held = hold_split(cutouts, 0.25, seed=1)
    assert set(cutouts.hold[held]).isdisjoint(cutouts.hold[~held])
    assert [len(set(cutouts.hold[held & (cutouts.label == k)])) for k in range(3)] == [2, 2, 2]


def test_a_class_of_one_hold_cannot_be_split() -> None:
    pictures = np.zeros((3, 32, 32, 3), np.uint8)
    cutouts = Cutouts(pictures, np.array([0, 0, 1]), np.array([0, 1, 2]), ("jug", "pinch"), {})
    with pytest.raises(InputError, match="pinch"):
        hold_split(cutouts, 0.2, 0)


def scan_with_cutouts(root: Path) -> ScanFolder:
    scan = ScanFolder(root)
    rng = np.random.default_rng(0)
    rows: list[tuple[int, str, str, Role, bool]] = [
        (1, "red", "jug", "hold", False),
        (2, "blue", "crimp", "hold", False),
        (3, "red", "unknown", "hold", False),
        (4, "grey", "jug", "downclimb", False),
        (5, "red", "jug", "hold", True),
    ]
    scan.cutouts.mkdir(parents=True)
    for number, *_ in rows:
        Image.fromarray(draw("disc", rng)).save(scan.cutouts / f"{number}_0.webp")
    index = [Cutout(n, f"{n}_0.webp", "a.jpg", 900, 1.0, False) for n, *_ in rows]
    CutoutIndex(cutouts=tuple(index)).save(scan.cutouts / INDEX)
    holds = [
        Hold(number, "hold", colour=colour, type=kind, role=role, review=review)
        for number, colour, kind, role, review in rows
    ]
    Holds(metric=True, holds=tuple(holds)).save(scan.holds)
    return scan


def test_a_scan_gives_its_sure_holds(tmp_path: Path) -> None:
    scan = scan_with_cutouts(tmp_path / "scan")
    by_type = read_cutouts([scan.root], "type", 32)
    assert by_type.counts() == {"crimp": 1, "downclimb": 1, "jug": 1}
    assert by_type.meanings["downclimb"].role == "downclimb"
    by_both = read_cutouts([scan.root], "colour+type", 32)
    assert by_both.names == ("blue crimp", "downclimb", "red jug")
    assert by_both.meanings["red jug"].colour == "red"
    assert by_both.meanings["red jug"].type == "jug"
    assert read_cutouts([scan.root], "colour", 32).meanings["red"].type == "unknown"


def test_sources_that_are_no_source(tmp_path: Path, folders: Path) -> None:
    with pytest.raises(InputError, match="folder"):
        read_cutouts([tmp_path / "nothing-here"], "type", 32)
    (folders / "empty").mkdir()
    with pytest.raises(InputError, match="pictures"):
        read_cutouts([folders], "type", 32)
    (folders / "empty" / "a.png").write_bytes(b"no picture")
    with pytest.raises(InputError, match="not an image that is read here"):
        read_cutouts([folders], "type", 32)


def test_one_class_is_no_choice(tmp_path: Path) -> None:
    (tmp_path / "set" / "jug").mkdir(parents=True)
    Image.fromarray(draw("disc", np.random.default_rng(0))).save(tmp_path / "set/jug/1_0.png")
    with pytest.raises(InputError, match="jug"):
        read_cutouts([tmp_path / "set"], "type", 32)


@pytest.mark.slow
def test_the_command_trains_a_network_that_names_shapes(folders: Path, tmp_path: Path) -> None:
    (folders / "classes.toml").write_text('[[class]]\nname = "ring"\ncolour = "sea"\n')
    out = tmp_path / "shapes.onnx"
    words = ["train", "classifier", str(folders), "-o", str(out), "--side", "32"]
    assert main([*words, "--epochs", "60", "--batch", "12", "--rate", "4e-3"]) == 0
    classifier = open_classifier(out)
    assert classifier.names == KINDS
    assert classifier.side == 32
    assert classifier.meaning("ring").colour == "sea"
    rng = np.random.default_rng(5)
    fresh = [(kind, draw(kind, rng)) for kind in KINDS for _ in range(12)]
    pictures = [square_cutout(p[..., :3], p[..., 3] > 0, 32) for _, p in fresh]
    chance = classifier.confidences(np.stack(pictures))
    assert chance.sum(axis=1) == pytest.approx(np.ones(len(fresh)), abs=1e-5)
    right = [KINDS[k] == kind for k, (kind, _) in zip(chance.argmax(axis=1), fresh, strict=True)]
    # Guessing names a third; how well so short a training ends depends on the machine.
    assert np.mean(right) >= 0.75


@pytest.mark.usefixtures("ultralytics")
def test_yolo_trains_and_gives_back_the_names(folders: Path, tmp_path: Path) -> None:
    cutouts = read_cutouts([folders], "type", 32)
    out = tmp_path / "yolo.onnx"
    top = yolo.train_yolo(cutouts, ClassifierSettings(side=32, epochs=1), out, yolo.BASE, Silent())
    assert 0 <= top <= 1
    classifier = open_classifier(out)
    assert classifier.names == KINDS
    chance = classifier.confidences(cutouts.pictures[:5])
    assert chance.sum(axis=1) == pytest.approx(np.ones(5), abs=1e-4)


@pytest.mark.skipif(importlib.util.find_spec("ultralytics") is not None, reason="installed here")
def test_without_ultralytics_yolo_says_what_to_install(folders: Path, tmp_path: Path) -> None:
    cutouts = read_cutouts([folders], "type", 32)
    with pytest.raises(EnvironmentLacksError, match="ultralytics"):
        yolo.train_yolo(cutouts, ClassifierSettings(), tmp_path / "x.onnx", "b", Silent())


def colour_network(names: list[str]) -> object:
    """An ONNX network that answers the mean red, green and blue of a picture."""
    from onnx import TensorProto, helper

    given = helper.make_tensor_value_info("images", TensorProto.FLOAT, ["n", 3, "h", "w"])
    answer = helper.make_tensor_value_info("answer", TensorProto.FLOAT, ["n", 3])
    nodes = [
        helper.make_node("GlobalAveragePool", ["images"], ["mean"]),
        helper.make_node("Flatten", ["mean"], ["flat"]),
        helper.make_node("Mul", ["flat", "twenty"], ["answer"]),
    ]
    twenty = helper.make_tensor("twenty", TensorProto.FLOAT, [], [20.0])
    graph = helper.make_graph(nodes, "colour", [given], [answer], [twenty])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    entry = model.metadata_props.add()
    entry.key, entry.value = "names", json.dumps(names)
    return model


def test_any_onnx_classifier_with_names_is_read(tmp_path: Path) -> None:

    path = tmp_path / "other.onnx"
    onnx.save(colour_network(["reddish", "greenish", "bluish"]), path)
    classifier = open_classifier(path, {"bluish": Meaning("jug", role="downclimb")})
    assert classifier.side == 224  # the input is free and the file does not tell
    pictures = np.zeros((2, 64, 64, 3), np.uint8)
    pictures[0, ..., 2], pictures[1, ..., 0] = 200, 200
    chance = classifier.confidences(pictures)
    assert [classifier.names[k] for k in chance.argmax(axis=1)] == ["bluish", "reddish"]
    assert classifier.meaning("bluish").role == "downclimb"
    with pytest.raises(InputError, match="pinkish"):
        open_classifier(path, {"pinkish": Meaning("jug")})


def test_files_that_are_no_classifier(tmp_path: Path) -> None:

    with pytest.raises(InputError, match="file"):
        open_classifier(tmp_path / "none.onnx")
    (tmp_path / "bad.onnx").write_bytes(b"no network")
    with pytest.raises(InputError, match="load"):
        open_classifier(tmp_path / "bad.onnx")
    model = colour_network(["a", "b", "c"])
    del model.metadata_props[:]  # type: ignore[attr-defined]
    onnx.save(model, tmp_path / "nameless.onnx")
    with pytest.raises(InputError, match="names"):
        open_classifier(tmp_path / "nameless.onnx")
    onnx.save(colour_network(["a", "b"]), tmp_path / "two.onnx")
    with pytest.raises(InputError, match="expected"):
        open_classifier(tmp_path / "two.onnx").confidences(np.zeros((1, 8, 8, 3), np.uint8))
