"""Endpoints of apps: their registration and consent, and those of OAuth."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.apps.http import apps, oauth

ROUTERS: Final[tuple[APIRouter, ...]] = (apps.router,)
ROOT_ROUTERS: Final[tuple[APIRouter, ...]] = (oauth.router,)
