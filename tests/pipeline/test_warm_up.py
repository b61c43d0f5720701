"""The kernels that are compiled while a scan begins: the table names what there is."""

from __future__ import annotations

import ast
import importlib
import subprocess
from pathlib import Path
from typing import Any

import pytest

import walltopo
from walltopo.pipeline import warm_up
from walltopo.pipeline.warm_up import TABLE, compile_line, warming_up

LINES = TABLE.read_text(encoding="utf-8").splitlines()


def _named() -> set[tuple[str, str]]:
    return {(line.split(" ")[0], line.split(" ")[1]) for line in LINES}


@pytest.mark.parametrize("line", LINES, ids=lambda line: ".".join(line.split(" ")[:2]))
def test_every_line_is_a_kernel_with_types(line: str) -> None:
    module, function, signature = line.split(" ", 2)
    kernel = getattr(importlib.import_module(module), function)
    types = warm_up._signature_types(signature)
    assert len(types) == kernel.py_func.__code__.co_argcount


def test_a_kernel_of_the_table_is_compiled() -> None:
    line = next(line for line in LINES if "lift.label_image _count " in line)
    compile_line(line)
    from walltopo.segment.lift import label_image

    kinds = [str(kinds) for kinds in label_image._count.signatures]
    assert any("int32" in kind for kind in kinds)


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("walltopo.segment.lift.vote nothing ()", AttributeError),
        ("walltopo.segment.lift.label_image _count (secret(1),)", ValueError),
    ],
)
def test_a_wrong_line_is_an_error(line: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        compile_line(line)


def test_every_module_of_a_scan_with_kernels_is_in_the_table() -> None:
    """Those that no scan with the default settings calls are named here."""
    elsewhere = {
        "geometry.screen",
        "segment.lift.distance",
        "segment.lift.fast",
    }
    product = Path(walltopo.__file__).parent
    named = {module.removeprefix("walltopo.") for module, _ in _named()}
    for file in product.rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        kernels = [
            node
            for node in tree.body
            if isinstance(node, ast.FunctionDef)
            and any(isinstance(d, ast.Name) and d.id == "kernel" for d in node.decorator_list)
        ]
        room = ".".join(file.relative_to(product).with_suffix("").parts)
        assert not kernels or (room in named) != (room in elsewhere), room


def test_the_child_ends_with_the_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    children: list[subprocess.Popen[bytes]] = []

    class Watched(subprocess.Popen):  # type: ignore[type-arg]
        def __init__(self, *given: Any, **more: Any) -> None:
            super().__init__(*given, **more)
            children.append(self)

    monkeypatch.setattr(subprocess, "Popen", Watched)
    with pytest.raises(KeyboardInterrupt), warming_up():
        raise KeyboardInterrupt
    assert len(children) == 1
    assert children[0].poll() is not None
