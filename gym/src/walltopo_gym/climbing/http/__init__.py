"""Endpoints of climbing."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.climbing.http import ascents, opinions, people, sessions

ROUTERS: Final[tuple[APIRouter, ...]] = (
    ascents.router,
    opinions.router,
    opinions.comments_router,
    sessions.router,
    sessions.progress_router,
    people.router,
    people.follows_router,
    people.boards_router,
)
