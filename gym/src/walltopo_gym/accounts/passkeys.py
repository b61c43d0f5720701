"""Passkeys (W3C Web Authentication, level 3) by py_webauthn: added to an account, used to sign in.

Only discoverable credentials are used: signing in names no address, so addresses cannot be probed.
The device must verify its owner (PIN, finger, face), so a passkey counts as two factors.
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

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Challenge, Passkey, Person
from walltopo_gym.accounts.secrets import hash_of
from walltopo_gym.clock import now
from walltopo_gym.errors import RequestError, SignInNeededError

_GOOD_FOR: Final = timedelta(minutes=5)
_NAME: Final = "walltopo"


@dataclass(frozen=True)
class Site:
    """The server's address as browsers see it; passkeys belong to it."""

    origin: str

    @property
    def host(self) -> str:
        """Return the relying party's id."""
        return urlsplit(self.origin).hostname or ""


def ask_for_new(session: Session, site: Site, person: Person) -> dict[str, Any]:
    """Return the options for `navigator.credentials.create`."""
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
    payload: dict[str, Any] = json.loads(options_to_json(options))
    return payload


def add_passkey(
    session: Session, site: Site, person: UUID, name: str, credential: dict[str, Any]
) -> Passkey:
    """Store a passkey that a device made.

    Raises
    ------
    RequestError : it does not answer a challenge of this person and site.
    """
    from webauthn import verify_registration_response
    from webauthn.helpers.exceptions import WebAuthnException

    challenge = _use_challenge(session, credential, person)
    try:
        found = verify_registration_response(
            credential=credential,
            expected_challenge=challenge,
            expected_rp_id=site.host,
            expected_origin=site.origin,
            require_user_verification=True,
        )
    except (WebAuthnException, ValueError, KeyError, TypeError, RecursionError) as error:
        raise RequestError("passkey-not-added", why=error) from error
    row = Passkey(
        person_id=person,
        name=name,
        credential_id=found.credential_id,
        public_key=found.credential_public_key,
        sign_count=found.sign_count,
    )
    session.add(row)
    session.flush()
    log_change(session, "passkey.create", person=person, subject=str(row.id))
    return row


def ask_for_sign_in(session: Session, site: Site) -> dict[str, Any]:
    """Return the options for `navigator.credentials.get`."""
    from webauthn import generate_authentication_options, options_to_json
    from webauthn.helpers.structs import UserVerificationRequirement

    options = generate_authentication_options(
        rp_id=site.host,
        challenge=_challenge(session, None),
        user_verification=UserVerificationRequirement.REQUIRED,
    )
    payload: dict[str, Any] = json.loads(options_to_json(options))
    return payload


def person_of(session: Session, site: Site, credential: dict[str, Any]) -> UUID:
    """Return the person whose device signed the challenge.

    Raises
    ------
    SignInNeededError : the passkey is unknown, or the signature is invalid.
    """
    from webauthn import verify_authentication_response
    from webauthn.helpers import base64url_to_bytes
    from webauthn.helpers.exceptions import WebAuthnException

    try:
        challenge = _use_challenge(session, credential, None)
        key = base64url_to_bytes(str(credential["rawId"]))
        row = session.scalar(select(Passkey).where(Passkey.credential_id == key))
        if row is None:
            raise SignInNeededError("passkey-unknown")
        found = verify_authentication_response(
            credential=credential,
            expected_challenge=challenge,
            expected_rp_id=site.host,
            expected_origin=site.origin,
            credential_public_key=row.public_key,
            credential_current_sign_count=row.sign_count,
            require_user_verification=True,
        )
    except SignInNeededError:
        raise
    except (
        WebAuthnException,
        RequestError,
        ValueError,
        KeyError,
        TypeError,
        RecursionError,
    ) as error:
        raise SignInNeededError("passkey-wrong") from error
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


def _use_challenge(session: Session, credential: dict[str, Any], person: UUID | None) -> bytes:
    """Return the signed challenge and use it up.

    Raises
    ------
    RequestError : the challenge is unknown, too old, or another person's.
    """
    from webauthn.helpers import base64url_to_bytes

    try:
        client = json.loads(base64url_to_bytes(credential["response"]["clientDataJSON"]))
        challenge = base64url_to_bytes(client["challenge"])
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise RequestError("passkey-no-answer") from error
    is_ours = Challenge.challenge_hash == hash_of(challenge.hex()), Challenge.expires_at > now()
    whose = Challenge.person_id.is_(None) if person is None else Challenge.person_id == person
    gone = delete(Challenge).where(*is_ours, whose).returning(Challenge.id)
    if session.execute(gone).one_or_none() is None:
        raise RequestError("took-too-long", "try-again")
    return challenge
