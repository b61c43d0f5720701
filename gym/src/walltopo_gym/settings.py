"""The operator's settings: command line over environment over `gym.toml` in the data folder.

Unknown names are refused everywhere, so that a misspelt setting is never ignored.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal
from urllib.parse import urlsplit

from pydantic import Field, ValidationError, field_validator
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

from walltopo.core import SettingsError
from walltopo.core.files import read_toml
from walltopo.core.settings import unknown_setting
from walltopo_gym.domains import ascii_url

FILE = "gym.toml"
PREFIX = "WALLTOPO_GYM_"
HOME: Final = ("localhost", "127.0.0.1", "::1")  # where browsers take http for secure

# Names of the features that can be turned off.
Switch = Literal["clips", "competitions", "films", "hall", "insights", "inspections"]


class GymSettings(BaseSettings):
    """All settings of the platform; only `data` has no default."""

    model_config = SettingsConfigDict(env_prefix=PREFIX, extra="forbid", frozen=True)

    data: Path = Field(description="the folder of everything that is not elsewhere by a URL")
    database: str = Field("", description="SQLAlchemy URL; empty: SQLite in the data folder")
    objects: str = Field("", description="URL of the file store (s3://...); empty: a folder")
    address: str = Field(
        "",
        description="as people type it; links in mails begin with it; empty: localhost at the port",
    )
    host: str = Field("127.0.0.1", description="address to listen on")
    port: int = Field(8080, ge=0, le=65535, description="port to listen on; 0: any free one")
    proxies: tuple[str, ...] = Field(
        (), description="addresses of proxies whose X-Forwarded-For is believed"
    )

    features: tuple[Switch, ...] = Field(
        ("clips", "competitions", "films", "hall", "insights", "inspections"),
        description="optional features that are on",
    )

    sign_up: Literal["open", "invitation"] = Field("open", description="who may sign up")
    new_gyms: Literal["operators", "anyone"] = Field("operators", description="who may open a gym")
    session_days: int = Field(60, ge=1, le=400, description="how long a sign-in lasts")

    oidc_issuer: str = Field("", description="OpenID Connect provider to sign in by; empty: none")
    oidc_client_id: str = Field("", description="what this server is to the provider")
    oidc_client_secret: str = Field("", description="its secret there")
    oidc_name: str = Field("OpenID Connect", description="what to call the provider")

    mail_from: str = Field("", description="sender of mails; empty: the address's host")
    smtp_host: str = Field("", description="mail server; empty: mails are shown in the console")
    smtp_port: int = Field(0, ge=0, le=65535, description="its port; 0: 465 with tls, else 587")
    smtp_security: Literal["starttls", "tls", "none"] = Field(
        "starttls", description="how the connection to it is encrypted"
    )
    smtp_user: str = Field("", description="account there; empty: no sign-in")
    smtp_password: str = Field("", description="its password, as it is, without escapes")

    requests_per_minute: int = Field(
        3000, ge=0, description="most requests of one network (a hall may be one); 0: no limit"
    )
    metrics_token: str = Field("", description="lets Prometheus read /metrics; empty: nobody can")
    log: Literal["plain", "json"] = Field("plain", description="how the log is written")

    max_photo_mb: int = Field(100, ge=1, le=2000, description="largest photo")
    max_video_mb: int = Field(1000, ge=1, le=2000, description="largest video")
    max_photos: int = Field(
        400, ge=3, le=5000, description="most photos of one scan; a video is one"
    )
    max_clip_mb: int = Field(300, ge=1, le=2000, description="largest clip of an attempt")
    clip_minutes: int = Field(20, ge=1, description="reading a clip that takes longer is ended")
    clip_memory_mb: int = Field(
        4000, ge=0, description="reading a clip that holds more memory is ended; 0: no limit"
    )
    keep_free_mb: int = Field(1000, ge=0, description="uploads are refused below this free space")

    webhooks_to_private: bool = Field(
        False, description="webhooks, and messages to browsers, may go to our own networks, by http"
    )
    keep_originals_days: int = Field(
        365, ge=0, description="photos as they came go so long after the publication; 0: never"
    )

    backup_to: str = Field(
        "", description="folder or s3://bucket/prefix of the daily backups; empty: none are made"
    )
    backup_hour: int = Field(3, ge=0, le=23, description="hour of the daily backup, UTC")
    backups_kept: int = Field(
        7,
        ge=1,
        le=100,
        description="backups that are kept; older ones go after an equal newer one",
    )
    backup_endpoint: str = Field(
        "", description="address of the backups' S3 server; empty: as in the environment (AWS_...)"
    )
    backup_region: str = Field("", description="its region")
    backup_access_key: str = Field("", description="key of the account there")
    backup_secret_key: str = Field("", description="its secret")

    max_edited: int = Field(2, ge=1, description="scans opened in the editor at a time")
    workers: int = Field(1, ge=0, le=64, description="scans at a time in this process")
    stage_minutes: int = Field(120, ge=1, description="a stage that takes longer is ended")
    stage_memory_mb: int = Field(
        0, ge=0, description="a scan that holds more memory is ended; 0: no limit"
    )
    scan_settings: Path | None = Field(None, description="walltopo.toml for all scans")

    own_networks: bool = Field(
        False,
        description="gyms may have a network of their own, trained at night; needs "
        "walltopo-lab[train] where the worker runs",
    )
    own_network_minutes: int = Field(60, ge=1, le=600, description="how long it is trained")

    @field_validator("proxies", "features", mode="before")
    @classmethod
    def _words(cls, given: object) -> object:
        """Split a setting of the environment at commas."""
        return given.replace(",", " ").split() if isinstance(given, str) else given

    @property
    def database_url(self) -> str:
        """Return the database's URL for SQLAlchemy."""
        if not self.database:
            return f"sqlite:///{self.data.absolute() / 'gym.sqlite'}"
        # PostgreSQL's own spelling, and the driver that is installed.
        for spelled in ("postgres://", "postgresql://"):
            if self.database.startswith(spelled):
                return "postgresql+psycopg://" + self.database.removeprefix(spelled)
        return self.database

    @field_validator("database")
    @classmethod
    def _known_database(cls, given: str) -> str:
        """Refuse a URL of another kind of database."""
        if given and not re.match(r"(postgres(ql)?(\+psycopg)?://|sqlite:///.)", given):
            raise ValueError(
                "expected a URL such as postgresql://user@host/name, or nothing for SQLite"
            )
        return given

    @field_validator("backup_to")
    @classmethod
    def _known_target(cls, given: str) -> str:
        """Refuse a URL of another kind of store."""
        if "://" in given and not given.startswith("s3://"):
            raise ValueError("expected a folder such as /mnt/backups, or s3://bucket/prefix")
        return given

    @field_validator("address")
    @classmethod
    def _whole_host(cls, given: str) -> str:
        """Refuse an address that is no web address, or that has a path."""
        parts = urlsplit(given)
        if given and (parts.scheme not in ("http", "https") or not parts.hostname):
            raise ValueError("expected an address such as https://walls.gym.example")
        if parts.path.strip("/") or parts.query or parts.fragment:
            raise ValueError(
                "expected an address without a path: the platform needs a host name of its own, "
                "such as https://walls.gym.example"
            )
        ascii_url(given)  # refuses a host that is no domain
        return given

    @property
    def is_secure(self) -> bool:
        """Return whether browsers keep a sign-in at this server's address."""
        parts = urlsplit(self.link_base)
        reached = self.address or self.host in HOME
        return parts.scheme == "https" or (bool(reached) and parts.hostname in HOME)

    @property
    def link_base(self) -> str:
        """Return the address that links begin with, in ASCII, without a trailing slash.

        Browsers send and compare origins in this form, and mail servers know no other.
        """
        return ascii_url(self.address).rstrip("/") or f"http://localhost:{self.port}"

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Return only the values of `load_settings`, which has merged file, environment and command
        line."""
        return (init_settings,)


def load_settings(
    given: Mapping[str, object], environment: Mapping[str, str] = os.environ
) -> GymSettings:
    """Return the settings of `gym.toml`, the environment and the command line; the last one wins.

    Parameters
    ----------
    given : from the command line; None means not given.

    Raises
    ------
    SettingsError : an unknown name, or an invalid value; names the place.
    InputError : `gym.toml` is not valid TOML.
    """
    words = {key: value for key, value in given.items() if value is not None}
    named = {
        key.removeprefix(PREFIX).lower(): value
        for key, value in environment.items()
        if key.startswith(PREFIX)
    }
    data = words.get("data", named.get("data"))
    if data is None:
        raise SettingsError("no data folder", f"Give --data DIR or {PREFIX}DATA.")
    file = Path(str(data)) / FILE
    written = _read(file)
    for origin, names in ((f"environment, {PREFIX}...", named), (str(file), written)):
        for name in names:
            _refuse_unknown(name, origin)
    merged: dict[str, Any] = {**written, **named, **words}
    try:
        return GymSettings(**merged)
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(map(str, first["loc"]))
        raise SettingsError(f"{name}: {first['msg']} (it is {first['input']!r})") from error


def _read(file: Path) -> dict[str, Any]:
    return read_toml(file) if file.is_file() else {}


def _refuse_unknown(name: str, origin: str) -> None:
    if name in GymSettings.model_fields:
        return
    listing = "`walltopo gym settings` lists all."
    raise unknown_setting(name, GymSettings.model_fields, origin, listing)


def settings_markdown() -> str:
    """Return the settings' table for the documentation: name, default, limits."""
    from pydantic_core import PydanticUndefined

    lines = [
        "# Settings of the platform",
        "",
        f"In `DIR/{FILE}`, in the environment as `{PREFIX}NAME` (in capitals), or, some of them, "
        "as options of the command. An unknown name is an error.",
        "",
        "| name | default | what | allowed |",
        "|---|---|---|---|",
    ]
    for name, field in GymSettings.model_fields.items():
        given = field.default is not PydanticUndefined
        default = "(must be given)" if not given else f"`{field.default!r}`"
        words = getattr(field.annotation, "__args__", ())
        allowed = ", ".join(word for word in words if isinstance(word, str))
        ends = {type(end).__name__.lower(): end for end in field.metadata}
        low, high = (getattr(ends.get(key), key, "") for key in ("ge", "le"))
        allowed = allowed or (f"{low} .. {high}".strip() if ends else "")
        lines.append(f"| `{name}` | {default} | {field.description} | {allowed} |")
    return "\n".join(lines) + "\n"
