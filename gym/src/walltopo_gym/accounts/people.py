"""Accounts and profiles: lookup, creation, change of password, visibility."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from enum import StrEnum
from typing import Final
from uuid import UUID

from email_validator import EmailNotValidError, validate_email
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import (
    ApiToken,
    AppConnection,
    Identity,
    Passkey,
    Person,
    Profile,
    SignIn,
)
from walltopo_gym.errors import RequestError


def lock_person(session: Session, person: UUID) -> None:
    """Wait until no other transaction writes rows of a person: two copies at once become one."""
    session.execute(select(Person.id).where(Person.id == person).with_for_update())


def normalise_email(text: str) -> str:
    """Return the stored spelling of an address, so that accounts never differ in case only.

    Raises
    ------
    RequestError : the text is not an address.
    """
    try:
        checked = validate_email(text, check_deliverability=False)
    except EmailNotValidError as error:
        raise RequestError("email-invalid", why=error) from error
    return checked.normalized.lower()


# No hash of any password: who has it signs in otherwise, or resets it.
NO_PASSWORD: Final = "!"


def find_person(session: Session, email: str) -> Person | None:
    """Return the person with an address, or None."""
    return session.scalar(select(Person).where(Person.email == email))


def add_person(
    session: Session, email: str, name: str, password_hash: str, *, operator: bool = False
) -> Person:
    """Create an account. The caller has checked the password.

    Raises
    ------
    RequestError : the address has an account.
    """
    if find_person(session, email) is not None:
        raise RequestError("account-there", "account-there-hint", email=email)
    person = Person(email=email, name=name, password_hash=password_hash, operator=operator)
    session.add(person)
    session.flush()
    log_change(session, "person.create", person=person.id)
    return person


def set_password(session: Session, person: Person, password_hash: str) -> None:
    """Set a new password and end all sign-ins, tokens and connections of apps. The caller has
    checked the password."""
    person.password_hash = password_hash
    sign_out_everywhere(session, person.id)
    for kind in (ApiToken, AppConnection):
        session.execute(delete(kind).where(kind.person_id == person.id))
    log_change(session, "person.password", person=person.id)


def remove_ways_in(session: Session, person: UUID, keep: Collection[UUID]) -> None:
    """Remove a person's passkeys and identities at other servers, except those to keep."""
    for kind in (Passkey, Identity):
        gone = delete(kind).where(kind.person_id == person, kind.id.not_in(keep))
        for removed in session.scalars(gone.returning(kind.id)).all():
            log_change(session, "way-in.remove", person=person, subject=str(removed))


def sign_out_everywhere(session: Session, person: UUID, *, but: UUID | None = None) -> None:
    """End all sign-ins of a person, except one."""
    ended = delete(SignIn).where(SignIn.person_id == person)
    session.execute(ended if but is None else ended.where(SignIn.id != but))


class Audience(StrEnum):
    """Audiences of an item, in rising order; `GYM`: members of a common gym."""

    NOBODY = "nobody"
    FOLLOWERS = "followers"
    GYM = "gym"


class Category(StrEnum):
    """Divisions of boards, beside the year of birth."""

    UNSAID = ""
    WOMEN = "women"
    MEN = "men"
    OTHER = "other"


def profile_of(session: Session, person: UUID) -> Profile:
    """Return a person's profile; a default one outside of the session if there is none."""
    kept = session.get(Profile, person)
    if kept is not None:
        return kept
    return Profile(
        person_id=person,
        on_boards=False,
        category=Category.UNSAID,
        show_ascents=Audience.NOBODY,
        show_pins=Audience.NOBODY,
        show_body=Audience.NOBODY,
        feed=True,
        on_screens=False,
    )


def names_by_id(session: Session, people: Iterable[UUID | None]) -> Mapping[UUID | None, str]:
    """Return the names of those people whose accounts exist."""
    known = {person for person in people if person is not None}
    rows = session.execute(select(Person.id, Person.name).where(Person.id.in_(known)))
    return dict(rows.all())
