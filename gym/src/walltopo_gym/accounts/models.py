"""Tables of people and credentials. They hold hashes of secrets, never the secrets."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, LargeBinary, String, UniqueConstraint, false, true
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed

_PERSON = "people.id"


class Person(Keyed, Base):
    """A person with an account; `operator` may administer the whole server.

    `locked_at`: since then nobody can sign in to the account; null: it is not locked.
    """

    __tablename__ = "people"

    email: Mapped[str] = mapped_column(String(320), unique=True)
    name: Mapped[str] = mapped_column(String(80))
    password_hash: Mapped[str] = mapped_column(String(200))
    operator: Mapped[bool] = mapped_column(default=False)
    locked_at: Mapped[datetime | None]


class SignIn(Keyed, Base):
    """A browser in which a person is signed in.

    `confirmed_at`: when they last proved there who they are; None in a browser that another device
    let in.
    """

    __tablename__ = "sign_ins"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]
    browser: Mapped[str] = mapped_column(String(200), default="")
    confirmed_at: Mapped[datetime | None]


class KnownBrowser(Keyed, Base):
    """A browser in which a person signed in before; it is not a sign-in."""

    __tablename__ = "known_browsers"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]


class ApiToken(Keyed, Base):
    """An API token. It acts as its person, within its scopes.

    `grant_id`: of an app's access token; None: the person made it.
    """

    __tablename__ = "api_tokens"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    scopes: Mapped[list[str]] = mapped_column(JSON)
    expires_at: Mapped[datetime]
    grant_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("app_grants.id", ondelete="CASCADE"), index=True
    )


class App(Keyed, Base):
    """A registered app of others; its id is its client id (RFC 6749).

    `home_page` and `redirects` are addresses. `password_hash`: of the client's secret; None: a
    public client, which can keep no secret.
    """

    __tablename__ = "apps"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    home_page: Mapped[str] = mapped_column(String(500))
    redirects: Mapped[list[str]] = mapped_column(JSON)
    password_hash: Mapped[str | None] = mapped_column(String(64))


class AppConnection(Keyed, Base):
    """An app that a person has let act for them; `used_at`: when it last fetched tokens."""

    __tablename__ = "app_connections"
    __table_args__ = (UniqueConstraint("app_id", "person_id"),)

    app_id: Mapped[UUID] = mapped_column(ForeignKey("apps.id", ondelete="CASCADE"))
    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    used_at: Mapped[datetime | None]


class AppGrant(Keyed, Base):
    """One consent of a person, with the code that the app exchanges for tokens. All tokens that
    came from it end with it.

    `challenge`: of PKCE, S256. `expires_at`: of the code until it is used at `used_at`, then of the
    newest refresh token.
    """

    __tablename__ = "app_grants"

    connection_id: Mapped[UUID] = mapped_column(
        ForeignKey("app_connections.id", ondelete="CASCADE"), index=True
    )
    code_hash: Mapped[str] = mapped_column(String(64), unique=True)
    challenge: Mapped[str] = mapped_column(String(43))
    redirect: Mapped[str] = mapped_column(String(500))
    scopes: Mapped[list[str]] = mapped_column(JSON)
    used_at: Mapped[datetime | None]
    expires_at: Mapped[datetime]


class AppRefreshToken(Keyed, Base):
    """A refresh token of a grant. It is used once; its row stays, so that a second use is seen."""

    __tablename__ = "app_refresh_tokens"

    grant_id: Mapped[UUID] = mapped_column(
        ForeignKey("app_grants.id", ondelete="CASCADE"), index=True
    )
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    used_at: Mapped[datetime | None]


class Passkey(Keyed, Base):
    """The public key of a passkey."""

    __tablename__ = "passkeys"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    credential_id: Mapped[bytes] = mapped_column(LargeBinary(1023), unique=True)
    public_key: Mapped[bytes] = mapped_column(LargeBinary)
    sign_count: Mapped[int]
    used_at: Mapped[datetime | None]


class Challenge(Keyed, Base):
    """A challenge that a device signs once. `person_id` is the person who adds a passkey; None for
    a sign-in."""

    __tablename__ = "challenges"

    person_id: Mapped[UUID | None] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    challenge_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]


class SecondFactor(Keyed, Base):
    """The secret of a TOTP second factor, in plain text because the server computes the digits too.

    It is on once `confirmed_at` is set. `last_step` is the half minute of the last used code.
    """

    __tablename__ = "second_factors"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), unique=True)
    secret: Mapped[str] = mapped_column(String(64))
    last_step: Mapped[int]
    confirmed_at: Mapped[datetime | None]


class RecoveryCode(Keyed, Base):
    """A code that replaces the phone's digits once."""

    __tablename__ = "recovery_codes"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    code_hash: Mapped[str] = mapped_column(String(64))


class Identity(Keyed, Base):
    """A person's identity at another server (OpenID Connect)."""

    __tablename__ = "identities"
    __table_args__ = (UniqueConstraint("issuer", "subject"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    issuer: Mapped[str] = mapped_column(String(300))
    subject: Mapped[str] = mapped_column(String(255))


class OidcAttempt(Keyed, Base):
    """A sign-in at another server that has not come back yet."""

    __tablename__ = "oidc_attempts"

    state_hash: Mapped[str] = mapped_column(String(64), unique=True)
    nonce: Mapped[str] = mapped_column(String(64))
    verifier: Mapped[str] = mapped_column(String(64))
    expires_at: Mapped[datetime]


class DeviceSignIn(Keyed, Base):
    """A sign-in on its way from one browser to another (accounts/device_sign_in.py).

    `offer_hash` hashes the QR code's secret, `claim_hash` the secret of the browser that scanned
    it. `browser` names that browser and `code` is what it shows; `allowed`: the owner accepted.
    """

    __tablename__ = "device_sign_ins"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    sign_in_id: Mapped[UUID] = mapped_column(ForeignKey("sign_ins.id", ondelete="CASCADE"))
    offer_hash: Mapped[str] = mapped_column(String(64), unique=True)
    claim_hash: Mapped[str | None] = mapped_column(String(64), unique=True)
    browser: Mapped[str] = mapped_column(String(200), default="")
    code: Mapped[str] = mapped_column(String(6), default="")
    allowed: Mapped[bool] = mapped_column(default=False)
    expires_at: Mapped[datetime]


class MailedLink(Keyed, Base):
    """A single-use link that proves access to the mail of an address.

    `kind` is "sign-up" or "reset".
    """

    __tablename__ = "mailed_links"

    kind: Mapped[str] = mapped_column(String(10))
    email: Mapped[str] = mapped_column(String(320), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]


class Try(Base):
    """An attempt at something limited; `key` is a hash, so that no address is stored."""

    __tablename__ = "tries"
    __table_args__ = (Index("ix_tries_key_at", "key", "at"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(String(64))
    at: Mapped[datetime] = mapped_column(index=True)


class AuditEntry(Keyed, Base):
    """An entry of the audit log. It has no foreign keys, so it outlives person and subject."""

    __tablename__ = "audit"

    person_id: Mapped[UUID | None] = mapped_column(index=True)
    gym_id: Mapped[UUID | None] = mapped_column(index=True)
    action: Mapped[str] = mapped_column(String(40))
    subject: Mapped[str] = mapped_column(String(200), default="")
    details: Mapped[dict[str, Any]] = mapped_column(JSON, default=dict)


class Profile(Base):
    """The visibility settings of a person. Without a row others see the name only, and no board
    lists the person.

    `show_*` is one of `profiles.Audience`; `category` is "" or a division of a gym's boards.
    `birth_year` and `category` are shown to nobody; lengths are in centimetres. `feed`: the person
    wants the feed of followed people. `on_screens`: boards may list the person in public, in the
    hall and on the gym's website.
    """

    __tablename__ = "profiles"

    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True
    )
    on_boards: Mapped[bool] = mapped_column(default=False)
    category: Mapped[str] = mapped_column(String(10), default="")
    birth_year: Mapped[int | None]
    show_ascents: Mapped[str] = mapped_column(String(10), default="nobody")
    show_pins: Mapped[str] = mapped_column(String(10), default="nobody")
    show_body: Mapped[str] = mapped_column(String(10), default="nobody")
    height_cm: Mapped[int | None]
    reach_cm: Mapped[int | None]
    changed_at: Mapped[datetime] = mapped_column(default=now)
    feed: Mapped[bool] = mapped_column(default=True, server_default=true())
    on_screens: Mapped[bool] = mapped_column(default=False, server_default=false())
