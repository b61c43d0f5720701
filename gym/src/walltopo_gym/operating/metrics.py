"""Metrics of a server, for Prometheus."""

from __future__ import annotations

import shutil
from collections.abc import Iterable

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector
from sqlalchemy import func, select

from walltopo_gym.api.services import Services
from walltopo_gym.jobs.worker_slot import count_living_workers
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.scans.service import State

_BOUNDS = (0.005, 0.01, 0.02, 0.03, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0)


class Metrics:
    """The metrics of one server, in their own registry because a process may have several
    servers."""

    def __init__(self, services: Services) -> None:
        self.registry = CollectorRegistry()
        self.registry.register(_DatabaseMetrics(services))
        self._requests = Counter(
            "walltopo_requests", "Requests", ("endpoint", "status"), registry=self.registry
        )
        self._seconds = Histogram(
            "walltopo_request_seconds",
            "Time to the end of the answer",
            ("endpoint",),
            buckets=_BOUNDS,
            registry=self.registry,
        )

    def count_request(self, endpoint: str, status: int, seconds: float) -> None:
        """Count one request."""
        self._requests.labels(endpoint, str(status)).inc()
        self._seconds.labels(endpoint).observe(seconds)


class _DatabaseMetrics(Collector):
    """Metrics read from database and disk at each request."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def collect(self) -> Iterable[GaugeMetricFamily]:
        settings = self._services.settings
        scans = GaugeMetricFamily("walltopo_scans", "Scans by state", labels=["state"])
        workers = GaugeMetricFamily("walltopo_workers", "Workers that live")
        photos = GaugeMetricFamily("walltopo_photos_waiting", "Photos nobody has looked at yet")
        free = GaugeMetricFamily("walltopo_free_bytes", "Room left in the data folder")
        with self._services.database.reading() as session:
            counted = select(Scan.state, func.count()).group_by(Scan.state)
            states = {row[0]: row[1] for row in session.execute(counted)}
            waiting = select(func.count()).select_from(Photo).where(Photo.state == "received")
            photos.add_metric([], session.scalar(waiting) or 0)
        workers.add_metric([], count_living_workers(settings, self._services.database))
        for state in State:
            scans.add_metric([state.value], states.get(state.value, 0))
        free.add_metric([], shutil.disk_usage(settings.data).free)
        return scans, workers, photos, free
