"""Names of hold colours as people write them, in the app's languages."""

from __future__ import annotations

from typing import Final

from walltopo_gym.texts import same_key

# English, German, Czech and French names; the key is the colour's name in a scan.
_NAMES: Final = {
    "black": "black schwarz černá noir",
    "grey": "grey gray grau šedá gris",
    "white": "white weiß weiss bílá blanc",
    "red": "red rot červená rouge",
    "orange": "orange oranžová",
    "yellow": "yellow gelb žlutá jaune",
    "lime": "lime hellgrün limetková vert_clair",
    "green": "green grün zelená vert",
    "mint": "mint mátová menthe",
    "sky": "sky sky_blue hellblau světle_modrá bleu_ciel",
    "blue": "blue blau modrá bleu",
    "purple": "purple lila fialová violet",
    "pink": "pink rosa růžová rose",
    "brown": "brown braun hnědá marron",
    "wood": "wood holz dřevo bois",
}
_COLOURS: Final = {
    name.replace("_", " "): colour for colour, names in _NAMES.items() for name in names.split()
}


def colour_of(text: str) -> str:
    """Return the colour that a name means in any of the languages; a gym's own names stay as they
    are."""
    return _COLOURS.get(same_key(text), text)
