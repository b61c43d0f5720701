"""Accounts: made from a mailed link, found by address, given another password."""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import ApiToken, Person, SignIn
from walltopo_gym.accounts.passwords import Passwords, check_password

# No hash of any password: who has it signs in otherwise, or resets it.
NO_PASSWORD: Final = "!"


def find_person(session: Session, email: str) -> Person | None:
    """By address, in the one spelling."""
    return session.scalar(select(Person).where(Person.email == email))


def add_person(
    session: Session, email: str, name: str, password_hash: str, *, operator: bool = False
) -> Person:
    """A new account; its password has been checked.

    Raises
    ------
    InputError : the address has an account.
    """
    if find_person(session, email) is not None:
        raise InputError(f"{email} has an account already", "Sign in, or reset its password.")
    person = Person(email=email, name=name, password_hash=password_hash, operator=operator)
    session.add(person)
    session.flush()
    log_change(session, "person.create", person=person.id)
    return person


def set_password(session: Session, person: Person, password: str, passwords: Passwords) -> None:
    """Another password; every sign-in and token ends with the old one.

    Raises
    ------
    InputError : it is short or easily guessed.
    """
    check_password(password, person.email, person.name)
    person.password_hash = passwords.hash(password)
    sign_out_everywhere(session, person.id)
    session.execute(delete(ApiToken).where(ApiToken.person_id == person.id))
    log_change(session, "person.password", person=person.id)


def sign_out_everywhere(session: Session, person: UUID, *, but: UUID | None = None) -> None:
    """End all sign-ins of a person, except one."""
    ended = delete(SignIn).where(SignIn.person_id == person)
    session.execute(ended if but is None else ended.where(SignIn.id != but))
