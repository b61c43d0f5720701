"""Endpoints of accounts."""

from __future__ import annotations

from typing import Final

from fastapi import APIRouter

from walltopo_gym.accounts.http import account, sign_in, ways_in

ROUTERS: Final[tuple[APIRouter, ...]] = (
    account.router,
    sign_in.router,
    ways_in.router,
)
