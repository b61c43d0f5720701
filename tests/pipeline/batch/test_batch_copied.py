"""Photos and scans in a store of objects: copied to the worker and back, the manifest last."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import boto3
import obstore
import pytest
from moto.server import ThreadedMotoServer
from obstore.store import LocalStore, from_url
from tests.pipeline.batch.quick_scans import SETTINGS

from walltopo.core import InputError
from walltopo.pipeline.batch.job import ScanJob
from walltopo.pipeline.batch.remote import _file_stats, _upload_changes, run_anywhere
from walltopo.scans.object_store import fetch_missing

BUCKET = "walls"


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    """The URL of a bucket of an S3 server in this process; the environment leads to it."""
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    keys = {"aws_access_key_id": "k", "aws_secret_access_key": "s"}
    boto3.client("s3", "us-east-1", endpoint_url=address, **keys).create_bucket(Bucket=BUCKET)
    environment = {
        "ENDPOINT": address,
        "ALLOW_HTTP": "true",
        "REGION": "us-east-1",
        "ACCESS_KEY_ID": "k",
        "SECRET_ACCESS_KEY": "s",
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(f"AWS_{name}", value)
        yield f"s3://{BUCKET}"
    server.stop()


@pytest.mark.slow
def test_from_a_bucket_and_back(bucket: str, tiny_photos: Path) -> None:
    photos = from_url(f"{bucket}/photos")
    for photo in tiny_photos.iterdir():
        obstore.put(photos, photo.name, photo)
    job = ScanJob(
        photos=(f"{bucket}/photos",), out=f"{bucket}/wall", settings=tuple(SETTINGS.split())
    )
    first, second = run_anywhere(job), run_anywhere(job)
    assert (first.out, first.state) == (job.out, "done"), first.error
    assert (second.state, second.holds) == ("up to date", first.holds)
    out = from_url(job.out)
    manifest = json.loads(bytes(obstore.get(out, "scan.json").bytes()))
    assert all(stage["state"] == "done" for stage in manifest["stages"].values())
    assert b"-- started" in bytes(obstore.get(out, "scan.log").bytes())


def test_what_is_not_there_fails_alone(bucket: str) -> None:
    outcome = run_anywhere(ScanJob(photos=(f"{bucket}/none",), out=f"{bucket}/nothing"))
    assert (outcome.state, outcome.out) == ("failed", f"{bucket}/nothing")
    assert "no photos" in outcome.error
    outcome = run_anywhere(ScanJob(photos=("what://ever/a",), out=f"{bucket}/nothing"))
    assert "not a known object store" in outcome.error


def test_the_manifest_is_written_last_and_what_is_gone_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there, here = tmp_path / "there", tmp_path / "here"
    there.mkdir()
    for name in ("gone.glb", "kept.ply", "scan.json"):
        (there / name).write_text(name)
    store = LocalStore(there)
    assert fetch_missing(store, here) == 3
    before = _file_stats(here)
    kept = (there / "kept.ply").stat().st_mtime_ns
    order: list[str] = []
    put = obstore.put

    def noted(store: LocalStore, name: str, *rest: Any, **more: Any) -> Any:
        order.append(name)
        return put(store, name, *rest, **more)

    monkeypatch.setattr(obstore, "put", noted)
    (here / "gone.glb").unlink()
    for name in ("a.json", "scan.json", "work/z.json"):
        (here / name).parent.mkdir(exist_ok=True)
        (here / name).write_text("new")
    _upload_changes(store, here, before)
    written = {p.relative_to(there).as_posix(): p for p in there.rglob("*") if p.is_file()}
    assert set(written) == {"a.json", "kept.ply", "scan.json", "work/z.json"}
    assert sorted(order) == ["a.json", "scan.json", "work/z.json"]
    assert order[-1] == "scan.json"
    assert written["kept.ply"].stat().st_mtime_ns == kept


def test_keys_lead_nowhere_else(tmp_path: Path) -> None:
    there = tmp_path / "there"
    there.mkdir()
    (there / "a\\..\\b").write_text("x")
    with pytest.raises(InputError, match="leads out"):
        fetch_missing(LocalStore(there), tmp_path / "here")
