"""The mails that accounts need. They tell the reader alone whether the address has an account."""

from __future__ import annotations

from walltopo_gym.mail import Letter

__all__ = ["known_already", "reset_letter", "sign_up_letter", "unknown_letter"]

_UNASKED = "If it was not you, there is nothing to do."


def sign_up_letter(to: str, base: str, secret: str) -> Letter:
    """To an address without an account that wants one."""
    link = f"{base}/sign-up#{secret}"
    text = f"Open this within a day to choose a name and a password:\n\n{link}\n\n{_UNASKED}\n"
    return Letter(to, "Your account", text)


def known_already(to: str, base: str) -> Letter:
    """To an address that wants an account and has one."""
    text = (
        "Somebody asked for an account with this address. It has one already; sign in or reset "
        f"the password here:\n\n{base}/sign-in\n\n{_UNASKED}\n"
    )
    return Letter(to, "You have an account", text)


def reset_letter(to: str, base: str, secret: str) -> Letter:
    """To an account whose password is forgotten."""
    link = f"{base}/new-password#{secret}"
    text = f"Open this within an hour to choose a new password:\n\n{link}\n\n{_UNASKED}\n"
    return Letter(to, "A new password", text)


def unknown_letter(to: str, base: str) -> Letter:
    """To an address without an account whose password is to be reset."""
    text = (
        "Somebody asked for a new password of the account with this address. It has none; sign "
        f"up here:\n\n{base}/sign-up\n\n{_UNASKED}\n"
    )
    return Letter(to, "There is no account", text)
