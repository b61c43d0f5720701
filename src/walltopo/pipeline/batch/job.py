"""One scan of a batch: what is asked for, and how it ended."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

import msgspec

from walltopo.pipeline.settings import Settings, load_settings

State = Literal["done", "up to date", "failed", "lost"]


class Job(msgspec.Struct, frozen=True, kw_only=True):
    """A scan that is asked for.

    Parameters
    ----------
    photos : folders, photos or videos, or one URL of a store of objects; absolute.
    out : the scan folder, or its URL.
    reference : the scan that it is aligned into; empty for none.
    config : a file of settings; empty for none.
    settings : `section.key=value`, after the file's.
    """

    photos: tuple[str, ...]
    out: str
    reference: str = ""
    config: str = ""
    settings: tuple[str, ...] = ()


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """How a scan ended.

    Parameters
    ----------
    out : as in its `Job`.
    state : "up to date" where no stage had to run; "failed" where walltopo says why; "lost" where
        its process ended without a word, as often as it was tried.
    tries : how often it was begun.
    ran : the stages that were computed.
    photos, holds, routes : how many there are.
    error : what happened; hint : what to do.
    """

    out: str
    state: State
    seconds: float = 0.0
    tries: int = 1
    ran: tuple[str, ...] = ()
    photos: int = 0
    holds: int = 0
    routes: int = 0
    error: str = ""
    hint: str = ""

    @property
    def well(self) -> bool:
        """Whether the scan is finished."""
        return self.state in ("done", "up to date")


def settings_of_job(job: Job) -> Settings:
    """The settings that a job asks for.

    Raises
    ------
    SettingsError : one is unknown or impossible. InputError : their file cannot be read.
    """
    given = list(job.settings)
    if job.reference:
        # JSON's strings are TOML's too.
        given.insert(0, f"sparse.reference={json.dumps(job.reference, ensure_ascii=False)}")
    return load_settings(Path(job.config) if job.config else None, given)
