"""Tables of people and of what proves who they are. No secret stands in them, only its hash."""

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
    """Somebody with an account; `operator` may do what concerns the whole server."""

    __tablename__ = "people"

    email: Mapped[str] = mapped_column(String(320), unique=True)
    name: Mapped[str] = mapped_column(String(80))
    password_hash: Mapped[str] = mapped_column(String(200))
    operator: Mapped[bool] = mapped_column(default=False)


class SignIn(Keyed, Base):
    """One browser in which somebody is signed in."""

    __tablename__ = "sign_ins"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]
    browser: Mapped[str] = mapped_column(String(200), default="")


class KnownBrowser(Keyed, Base):
    """A browser in which somebody signed in before; it is no sign-in."""

    __tablename__ = "known_browsers"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]


class ApiToken(Keyed, Base):
    """A key for programs: acts as its person, within its scopes."""

    __tablename__ = "api_tokens"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    scopes: Mapped[list[str]] = mapped_column(JSON)
    expires_at: Mapped[datetime]


class Passkey(Keyed, Base):
    """A key of somebody's device that signs in instead of a password; only its public half."""

    __tablename__ = "passkeys"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    credential_id: Mapped[bytes] = mapped_column(LargeBinary(1023), unique=True)
    public_key: Mapped[bytes] = mapped_column(LargeBinary)
    sign_count: Mapped[int]
    used_at: Mapped[datetime | None]


class Challenge(Keyed, Base):
    """What a device is asked to sign; good once. `person_id`: who adds a passkey; None: who signs
    in."""

    __tablename__ = "challenges"

    person_id: Mapped[UUID | None] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    challenge_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]


class SecondFactor(Keyed, Base):
    """What a phone makes six digits of. The secret stands as it is, for the server makes them, too;
    asked for once `confirmed_at`. `last_step`: the half minute of the last code that was used."""

    __tablename__ = "second_factors"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), unique=True)
    secret: Mapped[str] = mapped_column(String(64))
    last_step: Mapped[int]
    confirmed_at: Mapped[datetime | None]


class RecoveryCode(Keyed, Base):
    """Signs in once where the phone is lost."""

    __tablename__ = "recovery_codes"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    code_hash: Mapped[str] = mapped_column(String(64))


class Identity(Keyed, Base):
    """Who somebody is to another server (OpenID Connect)."""

    __tablename__ = "identities"
    __table_args__ = (UniqueConstraint("issuer", "subject"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    issuer: Mapped[str] = mapped_column(String(300))
    subject: Mapped[str] = mapped_column(String(255))


class OidcAttempt(Keyed, Base):
    """A browser that was sent to another server and has not come back yet."""

    __tablename__ = "oidc_attempts"

    state_hash: Mapped[str] = mapped_column(String(64), unique=True)
    nonce: Mapped[str] = mapped_column(String(64))
    verifier: Mapped[str] = mapped_column(String(64))
    expires_at: Mapped[datetime]


class Handover(Keyed, Base):
    """A sign-in on its way from one browser to another (accounts/handovers.py); good once.

    `offer_hash`: of what the QR code shows; `claim_hash`: of what the browser that scanned it was
    given for it, which calls itself `browser` and shows `code`; `allowed`: both showed the same.
    """

    __tablename__ = "handovers"

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    sign_in_id: Mapped[UUID] = mapped_column(ForeignKey("sign_ins.id", ondelete="CASCADE"))
    offer_hash: Mapped[str] = mapped_column(String(64), unique=True)
    claim_hash: Mapped[str | None] = mapped_column(String(64), unique=True)
    browser: Mapped[str] = mapped_column(String(200), default="")
    code: Mapped[str] = mapped_column(String(6), default="")
    allowed: Mapped[bool] = mapped_column(default=False)
    expires_at: Mapped[datetime]


class MailedLink(Keyed, Base):
    """A link that proves that somebody reads the mail of an address; good once.

    `kind` is "sign-up" or "reset".
    """

    __tablename__ = "mailed_links"

    kind: Mapped[str] = mapped_column(String(10))
    email: Mapped[str] = mapped_column(String(320), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]


class Try(Base):
    """One try at something that is limited; `key` is a hash, so that no address is kept."""

    __tablename__ = "tries"
    __table_args__ = (Index("ix_tries_key_at", "key", "at"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    key: Mapped[str] = mapped_column(String(64))
    at: Mapped[datetime] = mapped_column(index=True)


class AuditEntry(Keyed, Base):
    """Who changed what. It outlives both: names no row by foreign key."""

    __tablename__ = "audit"

    person_id: Mapped[UUID | None] = mapped_column(index=True)
    gym_id: Mapped[UUID | None] = mapped_column(index=True)
    action: Mapped[str] = mapped_column(String(40))
    subject: Mapped[str] = mapped_column(String(200), default="")
    details: Mapped[dict[str, Any]] = mapped_column(JSON, default=dict)


class Profile(Base):
    """What somebody lets others know of them; who has no row has said nothing: nobody sees more
    than their name, and they are on no board.

    `show_*` is one of `profiles.Audience`; `category` is "" or what boards of a gym may be
    divided by; `birth_year` and `category` are shown to nobody, lengths are centimetres. `feed`:
    they like to see what those climb whom they follow. `on_screens`: boards may show them to
    everybody, in the hall and on the gym's website.
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
