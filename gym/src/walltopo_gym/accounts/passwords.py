"""Passwords: hashed by argon2id (argon2-cffi's defaults, RFC 9106); leaked or weak ones are
refused."""

from __future__ import annotations

import unicodedata
from typing import Annotated
from uuid import UUID

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from pydantic import Field, SecretStr

from walltopo_gym.accounts.leaked import SHORTEST, is_leaked
from walltopo_gym.accounts.limits import count_old_password
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.services import Services
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.errors import ForbiddenError, RequestError

LONGEST = 200
Password = Annotated[SecretStr, Field(max_length=LONGEST)]
_MIN_SCORE = 2  # of 0 to 4: more than a million guesses
_WORK = "a password is hashed"
_LOOKED_AT = 72  # zxcvbn's time grows with the square of the length


class Passwords:
    """Hashes passwords and checks passwords against hashes.

    Parameters
    ----------
    hasher : argon2id with its costs.
    """

    def __init__(self, hasher: PasswordHasher | None = None) -> None:
        self._hasher = hasher or PasswordHasher()
        self._nobody = self._hasher.hash("nobody has this")

    def hash(self, password: str) -> str:
        """Return a password's hash."""
        check_unlocked(_WORK)
        return self._hasher.hash(prepare_password(password))

    def matches(self, kept: str | None, password: str) -> bool:
        """Return whether the password matches. Takes as long without an account (`kept` None).

        Hashes from before passwords were prepared may be of the typed form or of its NFD.
        """
        check_unlocked(_WORK)
        forms = (prepare_password(password), password, unicodedata.normalize("NFD", password))
        against = self._nobody if kept is None else kept
        found = any(self._verify(against, form) for form in dict.fromkeys(forms))
        return found and kept is not None

    def _verify(self, kept: str, password: str) -> bool:
        try:
            return self._hasher.verify(kept, password)
        except (VerificationError, InvalidHashError):
            return False

    def is_dated(self, kept: str) -> bool:
        """Return whether a hash was made with other costs than today's."""
        return self._hasher.check_needs_rehash(kept)


def prepare_password(password: str) -> str:
    """Return a password as RFC 8265 (OpaqueString) compares it: with plain spaces, in NFC."""
    spaced = "".join(" " if unicodedata.category(letter) == "Zs" else letter for letter in password)
    return unicodedata.normalize("NFC", spaced)


def check_password(password: str, *known: str) -> None:
    """Refuse passwords that are short, leaked, common, or derived from facts about the person.

    Source: D. Wheeler, "zxcvbn: low-budget password strength estimation", USENIX Security 2016;
    with its lists of common passwords.

    Raises
    ------
    RequestError : says why, and what to choose.
    """
    check_unlocked("the strength of a password is estimated")
    password = prepare_password(password)
    if not SHORTEST <= len(password) <= LONGEST:
        raise RequestError("password-length", count=len(password), least=SHORTEST, most=LONGEST)
    if is_leaked(password):
        raise RequestError("password-leaked", "password-four-words")
    from zxcvbn import zxcvbn

    parts = [part for text in known for part in (text, *text.replace("@", " ").split())]
    judged = zxcvbn(password[:_LOOKED_AT], user_inputs=["walltopo", *parts])
    if judged["score"] < _MIN_SCORE:
        reason = judged["feedback"]["warning"] or "It would be guessed soon."
        raise RequestError("password-not-safe", "password-four-words", why=reason)


def check_own_password(services: Services, person: UUID, password: SecretStr) -> None:
    """Check one's password outside of a transaction, because hashing takes long.

    Raises
    ------
    ForbiddenError : the password is wrong.
    TooManyError : there were too many recent attempts.
    """
    with services.database.writing() as session:
        count_old_password(session, person)
        kept = session.get_one(Person, person).password_hash
    if not services.get(Passwords).matches(kept, password.get_secret_value()):
        raise ForbiddenError("password-wrong")
