"""The mails that accounts need. They tell the reader alone whether the address has an account."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import msgspec
from sqlalchemy.orm import Session

from walltopo_gym.accounts.mailed_links import Kind, new_link
from walltopo_gym.accounts.people import find_person
from walltopo_gym.languages import Language
from walltopo_gym.mail import Letter


def letter_asked_for(
    session: Session, kind: Kind, to: str, base: str, language: Language
) -> Letter:
    """The letter to an address that asked for a link: with the link, or with why there is none.

    Parameters
    ----------
    base : the server's address, without a slash at the end.
    """
    words = _letters()[language]
    match kind, find_person(session, to) is not None:
        case "sign-up", False:
            name, place = "sign-up", f"sign-up#{new_link(session, kind, to)}"
        case "sign-up", True:
            name, place = "sign-up-known", "sign-in"
        case "reset", True:
            name, place = "reset", f"new-password#{new_link(session, kind, to)}"
        case _:
            name, place = "reset-unknown", "sign-up"
    text = f"{words[name]['text']}\n\n{base}/{place}\n\n{words['unasked']['text']}\n"
    return Letter(to, words[name]["subject"], text)


@cache
def _letters() -> Mapping[Language, Mapping[str, Mapping[str, str]]]:
    content = files("walltopo_gym.accounts").joinpath("letters.json").read_bytes()
    return msgspec.json.decode(content, type=dict[Language, dict[str, dict[str, str]]])
