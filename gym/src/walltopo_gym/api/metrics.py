"""Figures for Prometheus at `/metrics`, for whoever has the token of the settings."""

from __future__ import annotations

import hmac
import shutil
from collections.abc import Iterable
from datetime import timedelta

from fastapi import APIRouter, Request
from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector
from sqlalchemy import func, select
from starlette.responses import Response

from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.scans.models import Scan, Worker
from walltopo_gym.scans.states import State
from walltopo_gym.uploads.models import Photo

router = APIRouter(include_in_schema=False)

_BOUNDS = (0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0)


class Metrics:
    """The figures of one server; its own registry, for there may be several in a process."""

    def __init__(self, services: Services) -> None:
        self.registry = CollectorRegistry()
        self.registry.register(_Table(services))
        self._requests = Counter(
            "walltopo_requests", "Requests", ("endpoint", "status"), registry=self.registry
        )
        self._seconds = Histogram(
            "walltopo_request_seconds", "Time to the end of the answer", ("endpoint",),
            buckets=_BOUNDS, registry=self.registry,
        )  # fmt: skip

    def note(self, endpoint: str, status: int, seconds: float) -> None:
        """Count one request."""
        self._requests.labels(endpoint, str(status)).inc()
        self._seconds.labels(endpoint).observe(seconds)


class _Table(Collector):
    """What stands in the tables and on the disk, looked up when it is asked for."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def collect(self) -> Iterable[GaugeMetricFamily]:
        settings = self._services.settings
        scans = GaugeMetricFamily("walltopo_scans", "Scans by state", labels=["state"])
        workers = GaugeMetricFamily("walltopo_workers", "Workers that were heard of lately")
        photos = GaugeMetricFamily("walltopo_photos_waiting", "Photos nobody has looked at yet")
        free = GaugeMetricFamily("walltopo_free_bytes", "Room left in the data folder")
        heard = now() - timedelta(seconds=settings.silent_s)
        with self._services.database.reading() as session:
            counted = select(Scan.state, func.count()).group_by(Scan.state)
            states = {row[0]: row[1] for row in session.execute(counted)}
            alive = select(func.count()).select_from(Worker).where(Worker.at > heard)
            waiting = select(func.count()).select_from(Photo).where(Photo.state == "received")
            workers.add_metric([], session.scalar(alive) or 0)
            photos.add_metric([], session.scalar(waiting) or 0)
        for state in State:
            scans.add_metric([state.value], states.get(state.value, 0))
        free.add_metric([], shutil.disk_usage(settings.data).free)
        return scans, workers, photos, free


@router.get("/metrics")
def read_metrics(request: Request, services: ServicesOf) -> Response:
    """The figures; without a token in the settings there are none to see."""
    token = services.settings.metrics_token
    given = request.headers.get("authorization", "").encode()
    if not token or not hmac.compare_digest(given, f"Bearer {token}".encode()):
        raise NotFoundError("not found")
    metrics: Metrics = request.app.state.metrics
    return Response(generate_latest(metrics.registry), media_type="text/plain; version=0.0.4")
