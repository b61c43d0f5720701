"""Passwords: argon2id (argon2-cffi's defaults, RFC 9106); none that leaked or is soon guessed."""

from __future__ import annotations

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError

from walltopo.core import InputError
from walltopo_gym.accounts.leaked import is_leaked

SHORTEST, LONGEST = 10, 200
_LEAST_SCORE = 2  # of 0 to 4: more than a million guesses
_LOOKED_AT = 72  # zxcvbn's time grows with the square of the length
_BETTER = "Four random words are good."


class Passwords:
    """Makes and checks hashes.

    Parameters
    ----------
    hasher : argon2id with its costs.
    """

    def __init__(self, hasher: PasswordHasher | None = None) -> None:
        self._hasher = hasher or PasswordHasher()
        self._nobody = self._hasher.hash("nobody has this")

    def hash(self, password: str) -> str:
        """What is kept of a password."""
        return self._hasher.hash(password)

    def matches(self, kept: str | None, password: str) -> bool:
        """Whether it is the one; takes as long where there is no such account (`kept` None)."""
        try:
            self._hasher.verify(self._nobody if kept is None else kept, password)
        except (VerificationError, InvalidHashError):
            return False
        return kept is not None

    def is_dated(self, kept: str) -> bool:
        """Whether it was made with other costs than are asked for today."""
        return self._hasher.check_needs_rehash(kept)


def check_password(password: str, *known: str) -> None:
    """Refuse what is short, leaked, common, or made of what everybody knows of this person.

    Source: D. Wheeler, "zxcvbn: low-budget password strength estimation", USENIX Security 2016;
    with its lists of common passwords.

    Raises
    ------
    InputError : says why, and what to choose.
    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise InputError(
            f"the password has {len(password)} characters, expected {SHORTEST} to {LONGEST}"
        )
    if is_leaked(password):
        raise InputError("this password stands in lists of leaked ones", _BETTER)
    from zxcvbn import zxcvbn

    parts = [part for text in known for part in (text, *text.replace("@", " ").split())]
    judged = zxcvbn(password[:_LOOKED_AT], user_inputs=["walltopo", *parts])
    if judged["score"] < _LEAST_SCORE:
        reason = judged["feedback"]["warning"] or "It would be guessed soon."
        raise InputError(f"this password is not safe: {reason}", _BETTER)
