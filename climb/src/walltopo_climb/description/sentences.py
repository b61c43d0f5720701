"""Sentences for the steps of a route, in several languages, by Project Fluent's templates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final, Literal, get_args

import msgspec
from fluent.runtime import FluentBundle, FluentResource

from walltopo_climb.description.steps import Step

Language = Literal["en", "de", "cs", "fr"]
Detail = Literal["short", "normal", "full"]
Unit = Literal["centimetres", "hands"]
LANGUAGES: Final[tuple[Language, ...]] = get_args(Language)
DETAILS: Final[tuple[Detail, ...]] = get_args(Detail)
UNITS: Final[tuple[Unit, ...]] = get_args(Unit)

HAND_M: Final = 0.1  # breadth of a hand with its thumb: 10.7 cm of men, 9.2 of women (DIN 33402)
_STEP_CM: Final = 5  # distances are rounded to it
_VERTICAL_DEG: Final = 3  # a smaller steepness is vertical
_FEET: Final = ("foot", "foot_off", "start_foot")
# Characters a second of a calm voice: 150 words a minute of 6 characters.
_VOICE: Final = 15.0


@dataclass(frozen=True)
class Wording:
    """How a route is described.

    Parameters
    ----------
    detail : short names direction and distance of the hands' moves; normal adds types and feet;
        full adds sizes and heights. unit : of distances.
    """

    language: Language = "en"
    detail: Detail = "normal"
    unit: Unit = "centimetres"


USUAL: Final = Wording()


class Sentence(msgspec.Struct, frozen=True):
    """A sentence about a step.

    Parameters
    ----------
    step : the subject. text : the sentence.
    speech : duration of a calm voice, s; `speech_s` in the file.
    """

    step: Step
    text: str
    speech: float = msgspec.field(name="speech_s")


def sentences_of(steps: tuple[Step, ...], words: Wording = USUAL) -> tuple[Sentence, ...]:
    """Return the sentences about the steps of a route."""
    spoken = [step for step in steps if words.detail != "short" or step.kind not in _FEET]
    texts = [_text(step, words) for step in spoken]
    return tuple(
        Sentence(step, text, round(len(text) / _VOICE, 1))
        for step, text in zip(spoken, texts, strict=True)
    )


def _text(step: Step, words: Wording) -> str:
    bundle = _templates_of(words.language)
    names = [f"{step.kind}-{words.detail}", step.kind]
    if step.origin != step.limb:
        names = [f"{step.kind}_from_other-{words.detail}", f"{step.kind}_from_other", *names]
    found = next(name for name in names if bundle.has_message(name))
    pattern = bundle.get_message(found).value
    text, errors = bundle.format_pattern(pattern, _template_values(step, words.unit))
    if errors:
        raise errors[0]
    return str(text)


def _template_values(step: Step, unit: Unit) -> dict[str, Any]:
    """Return the variables of the templates."""
    steep = abs(step.steepness_deg)
    leaning = "slab" if step.steepness_deg < 0 else "overhang"
    return {
        "limb": step.limb,
        "origin": step.origin,
        "type": step.hold_type,
        "size": step.size,
        "clock": step.clock,
        "unit": unit,
        "distance": spoken_distance(step.distance, unit),
        "apart": spoken_distance(step.apart, unit),
        "height": round(step.height, 2),
        "steepness": round(steep),
        "wall": "vertical" if steep < _VERTICAL_DEG else leaning,
        "name": step.name,
        "hands": step.hands,
        "moves": step.moves,
    }


def spoken_distance(metres: float, unit: Unit) -> int:
    """Return a spoken distance: hand widths, or centimetres in steps of five; at least 1."""
    if unit == "hands":
        return max(round(metres / HAND_M), 1)
    return max(round(metres * 100 / _STEP_CM) * _STEP_CM, _STEP_CM)


@cache
def _templates_of(language: Language) -> Any:
    """Return the templates of a language."""
    path = files("walltopo_climb.description").joinpath("locales", f"{language}.ftl")
    bundle = FluentBundle([language], use_isolating=False)
    bundle.add_resource(FluentResource(path.read_text(encoding="utf-8")))
    return bundle
