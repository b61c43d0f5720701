"""Endpoints of health, metrics, server facts, a person's own data, and the operator's page."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.operating.http import backups, gyms, health, jobs, server, setup, storage, users

ROUTERS: Final[tuple[APIRouter, ...]] = (
    server.about_router,
    server.router,
    health.router,
    gyms.router,
    jobs.router,
    storage.router,
    backups.router,
    setup.router,
    users.router,
)
