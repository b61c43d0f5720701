"""What is said has a code; each code has its words in each language, with the same places."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import pytest
from gym.tests.worlds import World

from walltopo_gym.api.messages import message_of, templates

ROOT = Path(__file__).resolve().parents[2]
PLACE = re.compile(r"\{(\w+)\}")


@pytest.mark.parametrize("language", ["de", "cs", "fr"])
def test_each_code_has_its_words(language: str) -> None:
    words = json.loads((ROOT / "web" / "src" / "said" / f"{language}.json").read_text())
    assert words.keys() == templates().keys()
    for code, text in templates().items():
        assert words[code].strip()
        assert words[code] != text, code
        # Some languages say it without a value that English has; none invents one.
        assert set(PLACE.findall(words[code])) <= set(PLACE.findall(text)), code


def shapes_in_source() -> set[str]:
    """Every text of the source, with {} for what is filled in."""
    found = set()
    for path in (ROOT / "src" / "walltopo_gym").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.add(node.value)
            elif isinstance(node, ast.JoinedStr):
                parts = [p.value if isinstance(p, ast.Constant) else "{}" for p in node.values]
                found.add("".join(map(str, parts)))
    return found


def test_each_code_is_of_something_that_is_said() -> None:
    said = shapes_in_source()
    assert [t for t in templates().values() if PLACE.sub("{}", t) not in said] == []


def test_each_text_is_found_by_itself() -> None:
    for code, text in templates().items():
        filled = PLACE.sub(lambda place: f"<{place[1]}>", text)
        message = message_of(filled)
        assert message is not None
        assert message.code == code
        assert message.values == {name: f"<{name}>" for name in PLACE.findall(text)}
    assert message_of("something that nobody says") is None


def test_an_answer_has_code_and_values(world: World) -> None:
    path = f"{world.path}/walls"
    told = world.server.ask("POST", path, world.people["setter"], {"name": "Cave"}).json()
    assert told["code"] == "wall-name-taken"
    assert told["values"] == {"name": "'Cave'"}
    hint = world.server.ask("GET", "/me").json()
    assert (hint["code"], hint["hint_code"]) == ("sign-in-needed", "sign-in-first")
