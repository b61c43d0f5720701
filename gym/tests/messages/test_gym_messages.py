"""Errors have keys; each key has its sentence in each language, with the same places."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from gym.tests.worlds import World

from walltopo_gym.errors import RequestError
from walltopo_gym.messages import english, sentences

ROOT = Path(__file__).resolve().parents[2]
PLACE = re.compile(r"\{(\w+)\}")
# Plural forms as the Unicode CLDR names them.
FORMS = {
    "en": {"one", "other"},
    "de": {"one", "other"},
    "cs": {"one", "few", "many", "other"},
    "fr": {"one", "many", "other"},
}
FORM = re.compile(r"_(one|few|many|other)$")


def by_key(language: str) -> dict[str, dict[str, str]]:
    """The forms of each key's sentence; a sentence without plural has the form ''."""
    found: dict[str, dict[str, str]] = {}
    for name, text in sentences(language).items():
        form = FORM.search(name)
        found.setdefault(FORM.sub("", name), {})[form[1] if form else ""] = text
    return found


@pytest.mark.parametrize("language", FORMS)
def test_each_key_has_its_sentence(language: str) -> None:
    words, base = by_key(language), by_key("en")
    assert words.keys() == base.keys()
    for key, forms in words.items():
        assert forms.keys() == ({""} if "" in base[key] else FORMS[language]), key
        places = set(PLACE.findall("".join(base[key].values())))
        for text in forms.values():
            assert text.strip()
            assert language == "en" or text not in base[key].values(), key
            # Some languages say it without a value that English has; none invents one.
            assert set(PLACE.findall(text)) <= places, key


def raised() -> Iterator[tuple[str, list[str], set[str]]]:
    """Place, keys and values of each error that the source makes with constant keys."""
    kinds = {"RequestError"} | {kind.__name__ for kind in RequestError.__subclasses__()}
    for path in (ROOT / "src" / "walltopo_gym").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
                continue
            if node.func.id in kinds:
                keys = [
                    a.value
                    for a in node.args
                    if isinstance(a, ast.Constant) and isinstance(a.value, str)
                ]
                values = {word.arg for word in node.keywords if word.arg}
                yield f"{path.name}:{node.lineno}", keys, values


def test_each_error_has_a_sentence_and_its_values() -> None:
    known = by_key("en")
    sites = list(raised())
    assert len(sites) > 200
    for place, keys, values in sites:
        for key in keys:
            assert key in known, place
            assert set(PLACE.findall("".join(known[key].values()))) <= values, (place, key)


def test_each_key_is_used() -> None:
    constants = {
        node.value
        for path in (ROOT / "src" / "walltopo_gym").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    assert by_key("en").keys() <= constants


def test_a_number_chooses_the_form() -> None:
    texts = [english("photos-on-their-way", {"count": count}) for count in (0, 1, 2)]
    assert texts == [
        "0 photos are still uploading",
        "1 photo is still uploading",
        "2 photos are still uploading",
    ]


def test_an_answer_has_code_and_values(world: World) -> None:
    path = f"{world.path}/walls"
    answer = world.server.ask("POST", path, world.people["setter"], {"name": "Cave"}).json()
    assert answer["code"] == "wall-name-taken"
    assert answer["values"] == {"name": "Cave"}
    assert answer["title"] == "a wall 'Cave' already exists"
    hint = world.server.ask("GET", "/me").json()
    assert (hint["code"], hint["hint_code"]) == ("sign-in-needed", "sign-in-first")
