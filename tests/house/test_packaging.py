"""Files beside the wheels agree with them: conda recipe, containers, workflows, licences."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
VERSION = (ROOT / "VERSION").read_text(encoding="utf-8").strip()
# Conda's name, where it is another.
CONDA = {"opencv-python-headless": "py-opencv"}
MAKE = (ROOT / "Makefile").read_text(encoding="utf-8")
# Words of licences that ask for one's own source, or that the product may not be sold.
REFUSED = re.compile(r"\bA?GPL|GNU (Affero )?General|NonCommercial|\bSSPL|\bBUSL", re.IGNORECASE)


def project(folder: str = "") -> dict[str, Any]:
    text = (ROOT / folder / "pyproject.toml").read_text(encoding="utf-8")
    return dict(tomllib.loads(text)["project"])


def test_the_conda_recipe_wants_what_the_wheel_wants() -> None:
    text = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    recipe = yaml.safe_load(text.replace("${{ version }}", VERSION))
    assert recipe["context"]["version"] == VERSION
    wanted = [Requirement(line) for line in project()["dependencies"]]
    named = {f"{CONDA.get(want.name, want.name)} {want.specifier}" for want in wanted}
    assert set(recipe["requirements"]["run"]) - {"python >=3.11"} == named


def test_containers_install_extras_that_are_there() -> None:
    for file in (ROOT / "Containerfile", ROOT / "gym" / "deploy" / "Containerfile"):
        requests = set(
            re.findall(r"'(?:\.|\./gym|walltopo|walltopo-gym)\[(\w+)\]'", file.read_text())
        )
        extras = {*project()["optional-dependencies"], *project("gym")["optional-dependencies"]}
        assert requests
        assert requests <= extras


def test_workflows_run_what_is_there() -> None:
    for file in sorted((ROOT / ".github" / "workflows").glob("*.yml")):
        text = file.read_text(encoding="utf-8")
        steps = [s for job in yaml.safe_load(text)["jobs"].values() for s in job["steps"]]
        assert steps
        targets = {w for line in re.findall(r"make ([\w -]+)$", text, re.M) for w in line.split()}
        assert [name for name in targets if f"\n{name}:" not in MAKE] == []
    assert "bash .ci/run" in (ROOT / ".github" / "workflows" / "ci.yml").read_text()


def needed(*names: str) -> set[str]:
    """The distributions that these need, and what those need, without extras."""
    found: set[str] = set()
    ahead = list(names)
    while ahead:
        name = ahead.pop()
        if name in found:
            continue
        found.add(name)
        for line in distribution(name).requires or ():
            want = Requirement(line)
            if want.marker is None or want.marker.evaluate({"extra": ""}):
                ahead.append(want.name)
    return found


def test_all_that_is_needed_may_be_passed_on() -> None:
    refused = {}
    names = needed("walltopo", "walltopo-climb", "walltopo-gym")
    for name in names:
        about = distribution(name).metadata
        fields = ("License-Expression", "License")
        output = [about[field][:200] for field in fields if field in about]
        output += [line for line in about.get_all("Classifier") or () if line.startswith("License")]
        bad = [line for line in output if REFUSED.search(line) and "LGPL" not in line]
        if bad:
            refused[name] = bad
    assert len(names) > 60
    assert refused == {}
