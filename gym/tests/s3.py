"""An S3 server in this process, with a bucket."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import boto3
from moto.server import ThreadedMotoServer

BUCKET = "walls"


@contextmanager
def s3_server() -> Iterator[dict[str, str]]:
    """Serve; yields where it is, in the environment as for every S3 program."""
    server = ThreadedMotoServer(port=0, verbose=False)
    server.start()
    try:
        host, port = server.get_host_and_port()
        address = f"http://{host}:{port}"
        keys = {"aws_access_key_id": "k", "aws_secret_access_key": "s"}
        boto3.client("s3", "us-east-1", endpoint_url=address, **keys).create_bucket(Bucket=BUCKET)
        facts = {
            "ENDPOINT": address,
            "ALLOW_HTTP": "true",
            "REGION": "us-east-1",
            "ACCESS_KEY_ID": "k",
            "SECRET_ACCESS_KEY": "s",
        }
        yield {f"AWS_{name}": value for name, value in facts.items()}
    finally:
        server.stop()
