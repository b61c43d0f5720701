"""E-mail addresses in one spelling."""

from __future__ import annotations

from email_validator import EmailNotValidError, validate_email

from walltopo.core import InputError


def one_spelling(text: str) -> str:
    """An address as it is kept: nobody has two accounts that differ in capitals.

    Raises
    ------
    InputError : it is no address.
    """
    try:
        checked = validate_email(text, check_deliverability=False)
    except EmailNotValidError as error:
        raise InputError(f"not an e-mail address: {error}") from error
    return checked.normalized.lower()
