"""Download of weights on first use: official addresses, verified checksums, one cache."""

from __future__ import annotations

import hashlib
import os
import urllib.error
import urllib.request
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import EnvironmentLacksError, InputError, Progress
from walltopo.core.files import atomic_path

_META = "https://dl.fbaipublicfiles.com"
_CHUNK = 1 << 20


@dataclass(frozen=True)
class Weights:
    """One weights file to download.

    Parameters
    ----------
    file : its name in the cache (Ultralytics derives the architecture from it).
    address : URL at which its authors publish it.
    sha256 : of the whole file, lower case hexadecimal.
    licence : of the weights.
    """

    file: str
    address: str
    sha256: str
    licence: str = "Apache-2.0"


SAM_WEIGHTS = {
    "mobile-sam": Weights(
        "mobile_sam.pt",
        "https://github.com/ChaoningZhang/MobileSAM/raw/master/weights/mobile_sam.pt",
        "6dbb90523a35330fedd7f1d3dfc66f995213d81b29a5ca8108dbcdd4e37d6c2f",
    ),
    "sam-b": Weights(
        "sam_b.pt",
        f"{_META}/segment_anything/sam_vit_b_01ec64.pth",
        "ec2df62732614e57411cdcf32a23ffdf28910380d03139ee0f4fcbe91eb8c912",
    ),
    "sam2.1-t": Weights(
        "sam2.1_t.pt",
        f"{_META}/segment_anything_2/092824/sam2.1_hiera_tiny.pt",
        "7402e0d864fa82708a20fbd15bc84245c2f26dff0eb43a4b5b93452deb34be69",
    ),
    "sam2.1-b": Weights(
        "sam2.1_b.pt",
        f"{_META}/segment_anything_2/092824/sam2.1_hiera_base_plus.pt",
        "a2345aede8715ab1d5d31b4a509fb160c5a4af1970f199d9054ccfb746c004c5",
    ),
}


def cache_folder() -> Path:
    """Return the cache folder: $WALLTOPO_CACHE, else walltopo in the user's cache folder."""
    if chosen := os.environ.get("WALLTOPO_CACHE"):
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "walltopo"


def fetch(weights: Weights, progress: Progress, folder: Path | None = None) -> Path:
    """Return the path of a weights file in the cache; download the file if it is missing.

    Raises
    ------
    EnvironmentLacksError : no connection; the message names the address and the cache path.
    InputError : the checksum of the download differs from the published one.
    """
    path = (folder or cache_folder()) / weights.file
    if path.is_file():
        return path
    by_hand = f"Fetch {weights.address} elsewhere and put it at {path}"
    try:
        with (
            urllib.request.urlopen(weights.address, timeout=60) as stream,
            atomic_path(path) as temporary,
        ):
            total = int(stream.headers.get("Content-Length") or 0)
            progress.step(f"fetch {weights.file}", total // _CHUNK or None)
            digest = hashlib.sha256()
            with temporary.open("wb") as out:
                while chunk := stream.read(_CHUNK):
                    digest.update(chunk)
                    out.write(chunk)
                    progress.advance()
            if digest.hexdigest() != weights.sha256:
                raise InputError(
                    f"{weights.address}: sha256 is {digest.hexdigest()}, expected {weights.sha256}",
                    "The file was changed on the way or at its source; nothing was kept.",
                )
    except (urllib.error.URLError, TimeoutError, ConnectionError) as error:
        reason = getattr(error, "reason", error)
        raise EnvironmentLacksError(
            f"{weights.file} cannot be fetched from {weights.address} ({reason})", by_hand
        ) from error
    return path
