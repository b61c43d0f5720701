"""A network's metadata are read; missing and unreadable ones are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from walltopo.core import InputError
from walltopo.images.networks import Network, open_network
from walltopo.segment.detect.detector import shipped_model


def output(**metadata: str) -> Network:
    return Network(Path("m.onnx"), None, metadata)


@pytest.mark.parametrize("text", ["{0: 'hold', 1: 'volume'}", '["hold", "volume"]'])
def test_class_names_of_either_kind(text: str) -> None:
    assert output(names=text).names == ("hold", "volume")


@pytest.mark.parametrize("text", ["{1: 'hold'}", "hold", "{}", "[1", ""])
def test_unreadable_class_names(text: str) -> None:
    with pytest.raises(InputError, match=r"m\.onnx"):
        _ = output(names=text).names


def test_class_names_are_needed_and_numbers_have_defaults() -> None:
    with pytest.raises(InputError, match="lack `names`"):
        _ = output().names
    assert output().number("score", 0.3) == 0.3
    assert output(score="0.5").number("score", 0.3) == 0.5
    assert output(sides="[1, 2.5]").read_numbers("sides", [0.0, 0.0]) == [1.0, 2.5]
    with pytest.raises(InputError, match="expected a number"):
        output(score="high").number("score", 0.3)
    with pytest.raises(InputError, match="expected 3 numbers"):
        output(sides="[1, 2.5]").read_numbers("sides", [0.0] * 3)


def test_a_network_is_loaded_with_its_metadata() -> None:
    network = open_network(shipped_model(), threads=1)
    assert network.metadata["head"] == "votes"
    assert network.input_shape[-1] == 3


def test_what_is_no_network_is_named(tmp_path: Path) -> None:
    (tmp_path / "words.onnx").write_text("words")
    for name in ("words.onnx", "absent.onnx"):
        with pytest.raises(InputError, match=name):
            open_network(tmp_path / name)
