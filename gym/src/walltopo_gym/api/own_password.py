"""Whoever changes what an account is made of gives its password once more."""

from __future__ import annotations

from uuid import UUID

from pydantic import SecretStr

from walltopo_gym.accounts.limits import count_old_password
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.services import Services
from walltopo_gym.errors import ForbiddenError


def check_own_password(services: Services, person: UUID, password: SecretStr) -> None:
    """Check it; its costly part is no part of a transaction.

    Raises
    ------
    ForbiddenError : it is another one.
    TooManyError : it was tried too often of late.
    """
    with services.database.writing() as session:
        count_old_password(session, person)
        kept = session.get_one(Person, person).password_hash
    if not services.passwords.matches(kept, password.get_secret_value()):
        raise ForbiddenError("the password is not right")
