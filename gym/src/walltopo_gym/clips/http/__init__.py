"""Endpoints of clips."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.clips.http import clips, films, uploads

ROUTERS: Final[tuple[APIRouter, ...]] = (clips.router, films.router, uploads.router)
