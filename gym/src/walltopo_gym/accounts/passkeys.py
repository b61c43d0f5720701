"""Passkeys (W3C Web Authentication, level 3) by py_webauthn: added to an account, used to sign in.

Discoverable credentials only: who signs in names no address, so that none can be tried out. The
device has to know its owner (PIN, finger, face), so that it stands for two factors.
"""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final
from urllib.parse import urlsplit
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Challenge, Passkey, Person
from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.clock import now
from walltopo_gym.errors import SignInNeededError

_GOOD_FOR: Final = timedelta(minutes=5)
_NAME: Final = "walltopo"


@dataclass(frozen=True)
class Site:
    """What a passkey belongs to: the server's address as browsers see it."""

    origin: str

    @property
    def host(self) -> str:
        """The relying party's id."""
        return urlsplit(self.origin).hostname or ""


def ask_for_new(session: Session, site: Site, person: Person) -> dict[str, Any]:
    """What `navigator.credentials.create` wants."""
    from webauthn import generate_registration_options, options_to_json
    from webauthn.helpers.structs import (
        AuthenticatorSelectionCriteria,
        PublicKeyCredentialDescriptor,
        ResidentKeyRequirement,
        UserVerificationRequirement,
    )

    known = select(Passkey.credential_id).where(Passkey.person_id == person.id)
    options = generate_registration_options(
        rp_id=site.host,
        rp_name=_NAME,
        user_id=person.id.bytes,
        user_name=person.email,
        user_display_name=person.name,
        challenge=_challenge(session, person.id),
        authenticator_selection=AuthenticatorSelectionCriteria(
            resident_key=ResidentKeyRequirement.REQUIRED,
            user_verification=UserVerificationRequirement.REQUIRED,
        ),
        exclude_credentials=[PublicKeyCredentialDescriptor(id=k) for k in session.scalars(known)],
    )
    told: dict[str, Any] = json.loads(options_to_json(options))
    return told


def add_passkey(
    session: Session, site: Site, person: UUID, name: str, credential: dict[str, Any]
) -> Passkey:
    """Keep what a device made.

    Raises
    ------
    InputError : it is not the answer to a challenge of this person and site.
    """
    from webauthn import verify_registration_response
    from webauthn.helpers.exceptions import WebAuthnException

    challenge = _used(session, credential, person)
    try:
        found = verify_registration_response(
            credential=credential, expected_challenge=challenge, expected_rp_id=site.host,
            expected_origin=site.origin, require_user_verification=True,
        )  # fmt: skip
    except (WebAuthnException, ValueError, KeyError, TypeError) as error:
        raise InputError(f"this passkey cannot be added ({error})") from error
    row = Passkey(
        person_id=person, name=name, credential_id=found.credential_id,
        public_key=found.credential_public_key, sign_count=found.sign_count,
    )  # fmt: skip
    session.add(row)
    session.flush()
    log_change(session, "passkey.create", person=person, subject=str(row.id))
    return row


def ask_for_sign_in(session: Session, site: Site) -> dict[str, Any]:
    """What `navigator.credentials.get` wants."""
    from webauthn import generate_authentication_options, options_to_json
    from webauthn.helpers.structs import UserVerificationRequirement

    options = generate_authentication_options(
        rp_id=site.host,
        challenge=_challenge(session, None),
        user_verification=UserVerificationRequirement.REQUIRED,
    )
    told: dict[str, Any] = json.loads(options_to_json(options))
    return told


def person_of(session: Session, site: Site, credential: dict[str, Any]) -> UUID:
    """Whose device has signed.

    Raises
    ------
    SignInNeededError : nobody's, or not what it was asked to sign.
    """
    from webauthn import verify_authentication_response
    from webauthn.helpers import base64url_to_bytes
    from webauthn.helpers.exceptions import WebAuthnException

    try:
        challenge = _used(session, credential, None)
        key = base64url_to_bytes(str(credential["rawId"]))
        row = session.scalar(select(Passkey).where(Passkey.credential_id == key))
        if row is None:
            raise SignInNeededError("this passkey is not known")
        found = verify_authentication_response(
            credential=credential, expected_challenge=challenge, expected_rp_id=site.host,
            expected_origin=site.origin, credential_public_key=row.public_key,
            credential_current_sign_count=row.sign_count, require_user_verification=True,
        )  # fmt: skip
    except (WebAuthnException, InputError, ValueError, KeyError, TypeError) as error:
        raise SignInNeededError("this passkey is not right") from error
    row.sign_count, row.used_at = found.new_sign_count, now()
    return row.person_id


def _challenge(session: Session, person: UUID | None) -> bytes:
    challenge = secrets.token_bytes(32)
    session.execute(delete(Challenge).where(Challenge.expires_at < now()))
    kept = Challenge(
        person_id=person, challenge_hash=hash_of(challenge.hex()), expires_at=now() + _GOOD_FOR
    )
    session.add(kept)
    return challenge


def _used(session: Session, credential: dict[str, Any], person: UUID | None) -> bytes:
    """The challenge that a device says it has signed, if it is one of ours; it is good no more.

    Raises
    ------
    InputError : it is none, or too old, or somebody else's.
    """
    from webauthn.helpers import base64url_to_bytes

    try:
        client = json.loads(base64url_to_bytes(credential["response"]["clientDataJSON"]))
        challenge = base64url_to_bytes(client["challenge"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("this is no answer of a passkey") from error
    is_ours = Challenge.challenge_hash == hash_of(challenge.hex()), Challenge.expires_at > now()
    whose = Challenge.person_id.is_(None) if person is None else Challenge.person_id == person
    gone = delete(Challenge).where(*is_ours, whose).returning(Challenge.id)
    if session.execute(gone).one_or_none() is None:
        raise InputError("this took too long", "Try again.")
    return challenge
