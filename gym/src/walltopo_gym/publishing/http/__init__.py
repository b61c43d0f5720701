"""Endpoints of routes and publications."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.publishing.http import by_hand, lines, publishing, routes

ROUTERS: Final[tuple[APIRouter, ...]] = (
    routes.router,
    by_hand.router,
    lines.router,
    routes.pictures_router,
    publishing.router,
)
