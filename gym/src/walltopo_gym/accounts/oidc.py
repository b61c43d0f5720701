"""Signing in by another server (OpenID Connect, authorization code flow with PKCE), by Authlib.

The operator chooses the provider and trusts it: an account with an address that the provider has
verified belongs to that person. Needs the extra `walltopo-gym[oidc]`.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Identity, OidcAttempt
from walltopo_gym.accounts.people import NO_PASSWORD, add_person, find_person, normalise_email
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.clock import now
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.domains import ascii_url
from walltopo_gym.errors import ForbiddenError, SignInNeededError, UnavailableError
from walltopo_gym.texts import printable

_GOOD_FOR: Final = timedelta(minutes=10)
_PATIENCE_S: Final = 10
_KEPT_S: Final = 600
_ENDPOINTS: Final = "issuer", "authorization_endpoint", "token_endpoint", "jwks_uri"
_CONFIRMED_S: Final = 600  # a sign-in at the provider that is older proves nothing today
_MAX_BYTES: Final = 1_000_000
# Discovery documents by issuer, and when they came. Two requests at once may fetch one twice.
_DOCUMENTS: Final[dict[str, tuple[float, dict[str, Any]]]] = {}
_WORK: Final = "the provider of accounts is called"
_SIGNED_BY: Final = ["RS256", "PS256", "ES256", "EdDSA"]


@dataclass(frozen=True)
class Claims:
    """The provider's verified claims about a person; `is_fresh`: they signed in there just now."""

    issuer: str
    subject: str
    email: str
    name: str
    is_fresh: bool


@dataclass(frozen=True)
class Provider:
    """A provider and our registration with it.

    Parameters
    ----------
    issuer : its address, below which `.well-known/openid-configuration` lies.
    callback : our address to which it sends browsers back.
    """

    issuer: str
    client_id: str
    client_secret: str
    callback: str

    @property
    def discovery(self) -> dict[str, Any]:
        """Return the provider's discovery document, of at most some minutes ago.

        Raises
        ------
        UnavailableError : the provider does not respond or names another issuer.
        """
        base = ascii_url(self.issuer).rstrip("/")
        known = _DOCUMENTS.get(base)
        if known is not None and known[0] > time.monotonic() - _KEPT_S:
            return known[1]
        found = self._get(f"{base}/.well-known/openid-configuration")
        endpoints = (found.get(name) for name in _ENDPOINTS) if isinstance(found, dict) else (None,)
        if not all(isinstance(one, str) for one in endpoints) or (
            ascii_url(found["issuer"]).rstrip("/") != base
        ):
            raise UnavailableError("provider-other", issuer=self.issuer)
        _DOCUMENTS[base] = time.monotonic(), found
        return found

    def _get(self, url: str) -> dict[str, Any]:
        import requests

        check_unlocked(_WORK)
        until = time.monotonic() + _PATIENCE_S
        try:
            with requests.get(url, timeout=_PATIENCE_S, stream=True) as answer:
                answer.raise_for_status()
                content = b""
                for piece in answer.iter_content(None):
                    content += piece
                    if len(content) > _MAX_BYTES or time.monotonic() > until:
                        raise ValueError("the answer is too long, or too slow")
            body: dict[str, Any] = json.loads(content)
        except (requests.RequestException, ValueError) as error:
            raise UnavailableError(
                "provider-silent", "sign-in-otherwise", name=self.issuer
            ) from error
        return body

    def client(self) -> Any:
        """Return Authlib's session with the provider."""
        from authlib.integrations.requests_client import OAuth2Session

        return OAuth2Session(
            self.client_id,
            self.client_secret,
            scope="openid email profile",
            redirect_uri=self.callback,
            code_challenge_method="S256",
        )

    def keys(self) -> Any:
        """Return the provider's current public keys."""
        from joserfc.jwk import KeySet

        return KeySet.import_key_set(self._get(self.discovery["jwks_uri"]))  # type: ignore[arg-type]


@dataclass(frozen=True)
class Attempt:
    """A sign-in that a browser begins: the provider's address, and the secrets of the attempt."""

    url: str
    state: str
    nonce: str
    verifier: str


def begin_sign_in(provider: Provider) -> Attempt:
    """Return a new attempt to sign in."""
    state, nonce, verifier = (new_secret()[0] for _ in range(3))
    url, _ = provider.client().create_authorization_url(
        provider.discovery["authorization_endpoint"],
        state=state,
        nonce=nonce,
        code_verifier=verifier,
        max_age=_CONFIRMED_S,
    )
    return Attempt(str(url), state, nonce, verifier)


def store_attempt(session: Session, attempt: Attempt) -> None:
    """Store an attempt until its browser comes back."""
    session.execute(delete(OidcAttempt).where(OidcAttempt.expires_at < now()))
    session.add(
        OidcAttempt(
            state_hash=hash_of(attempt.state),
            nonce=attempt.nonce,
            verifier=attempt.verifier,
            expires_at=now() + _GOOD_FOR,
        )
    )


def use_attempt(session: Session, state: str) -> tuple[str, str]:
    """Return nonce and verifier of an attempt. Each state is valid once.

    Raises
    ------
    SignInNeededError : the state is unknown or too old.
    """
    gone = delete(OidcAttempt).where(
        OidcAttempt.state_hash == hash_of(state), OidcAttempt.expires_at > now()
    )
    attempt = session.execute(gone.returning(OidcAttempt.nonce, OidcAttempt.verifier)).one_or_none()
    if attempt is None:
        raise SignInNeededError("took-too-long", "sign-in-again")
    return attempt.nonce, attempt.verifier


def claims_of(provider: Provider, code: str, nonce: str, verifier: str) -> Claims:
    """Return the provider's claims for `code`.

    Raises
    ------
    SignInNeededError : the provider does not confirm it, or the signature is invalid.
    """
    return _verify_id_token(provider, _fetch_id_token(provider, code, verifier), nonce)


def _fetch_id_token(provider: Provider, code: str, verifier: str) -> str:
    import requests
    from authlib.common.errors import AuthlibBaseError

    check_unlocked(_WORK)
    try:
        token = provider.client().fetch_token(
            provider.discovery["token_endpoint"],
            grant_type="authorization_code",
            code=code,
            code_verifier=verifier,
            timeout=_PATIENCE_S,
        )
        return str(token["id_token"])
    except (requests.RequestException, AuthlibBaseError, KeyError, ValueError) as error:
        raise SignInNeededError("provider-not-confirmed", "sign-in-again") from error


def _verify_id_token(provider: Provider, token: str, nonce: str) -> Claims:
    """Verify an ID token (OpenID Connect Core 1.0, 3.1.3.7)."""
    from joserfc import jwt
    from joserfc.errors import JoseError

    wanted = jwt.JWTClaimsRegistry(
        leeway=60,
        iss={"essential": True, "value": provider.discovery["issuer"]},
        aud={"essential": True, "value": provider.client_id},
        exp={"essential": True},
        sub={"essential": True},
        nonce={"essential": True, "value": nonce},
    )
    try:
        claims = jwt.decode(token, provider.keys(), algorithms=_SIGNED_BY).claims
        wanted.validate(claims)
        several = isinstance(claims["aud"], list) and len(claims["aud"]) > 1
        if several and claims.get("azp") != provider.client_id:
            raise ValueError("the token is for another client")
    except (JoseError, ValueError) as error:
        raise SignInNeededError("provider-not-for-us", "sign-in-again") from error
    if claims.get("email_verified") is not True or not claims.get("email"):
        raise ForbiddenError("provider-not-verified", "provider-verify")
    email = normalise_email(str(claims["email"]))
    name = printable(str(claims.get("name") or ""))[:80].rstrip() or email.partition("@")[0][:80]
    at = claims.get("auth_time")
    is_fresh = isinstance(at, (int, float)) and at > now().timestamp() - _CONFIRMED_S
    return Claims(str(claims["iss"]), str(claims["sub"]), email, name, is_fresh)


def person_of(session: Session, claims: Claims, *, may_sign_up: bool) -> UUID:
    """Return the account of an identity; create it at the first sign-in.

    Raises
    ------
    ForbiddenError : there is no account, and this server needs an invitation.
    """
    known = select(Identity.person_id).where(
        Identity.issuer == claims.issuer, Identity.subject == claims.subject
    )
    found = session.scalar(known)
    if found is not None:
        return found
    person = find_person(session, claims.email)
    if person is None:
        if not may_sign_up:
            raise ForbiddenError("sign-up-by-invitation", "ask-your-gym")
        person = add_person(session, claims.email, claims.name, NO_PASSWORD)
    session.add(Identity(person_id=person.id, issuer=claims.issuer, subject=claims.subject))
    log_change(session, "identity.create", person=person.id, subject=claims.issuer)
    return person.id
