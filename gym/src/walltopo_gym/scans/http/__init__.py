"""Endpoints of scans and uploads."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.scans.http import own_networks, plates, scans, storage, uploads

ROUTERS: Final[tuple[APIRouter, ...]] = (
    scans.router,
    uploads.router,
    plates.router,
    own_networks.router,
    storage.router,
)
