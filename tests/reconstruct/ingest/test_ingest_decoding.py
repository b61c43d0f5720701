"""One bad file never ends the others: damage, crashes of decoders, memory, a full disk."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from made_files import ingested, picture, skipped_reasons, write_film, write_photos  # type: ignore[import-not-found]
from PIL import Image

from walltopo.core import EnvironmentLacksError, InputError, Silent
from walltopo.reconstruct.ingest.decoding import BUDGET, MemoryBudget, decode_files
from walltopo.reconstruct.ingest.image_file import decoded_photo
from walltopo.reconstruct.ingest.store import store_file
from walltopo.reconstruct.settings import IngestSettings


def _damage(path: Path, seed: int) -> None:
    """Cut off the last third and turn over some bits of the rest."""
    import numpy as np

    data = bytearray(path.read_bytes())
    data = data[: len(data) * 2 // 3]
    generator = np.random.default_rng(seed)
    for place in generator.integers(0, len(data), 40):
        data[place] ^= 1 << int(generator.integers(8))
    path.write_bytes(bytes(data))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("suffix", ["heic", "avif", "webp", "tif", "png", "jpg", "mp4"])
def test_a_damaged_file_is_left_out_with_a_reason(tmp_path: Path, suffix: str, seed: int) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    bad = tmp_path / f"bad.{suffix}"
    if suffix == "mp4":
        write_film(bad, 8, (320, 320))
    else:
        picture(9).save(bad)
    _damage(bad, seed)
    if suffix == "avif":
        bad = bad.rename(bad.with_suffix(".jpg"))  # named so it is looked at
    good = tmp_path / "good.jpg"
    picture(1).save(good)
    (tmp_path / "out").mkdir()
    files = [(0, bad), (1, good)]
    done = {d.number: d for d in decode_files(files, tmp_path / "out", IngestSettings(), Silent())}
    assert len(done[1].photos) == 1
    # libtiff and some bits of a JPEG leave a picture that can be looked at.
    assert done[0].photos or all(done[0].reasons)
    assert done[0].photos or done[0].reasons


def test_damage_by_format_says_which(tmp_path: Path) -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()
    folder = tmp_path / "in"
    write_photos(folder)
    for name in ("a.heic", "b.avif", "c.png", "d.webp"):
        path = folder / name
        picture(7).save(path)
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    (folder / "b.avif").rename(folder / "b.jpg")
    write_film(folder / "e.mp4", 8)
    whole = (folder / "e.mp4").read_bytes()
    (folder / "e.mp4").write_bytes(whole[: len(whole) // 2])
    reasons = skipped_reasons(ingested(tmp_path, folder))
    assert reasons.keys() == {"a.heic", "b.jpg", "c.png", "d.webp", "e.mp4"}
    for name, reason in reasons.items():
        assert reason.startswith(("damaged or cut off", "not an image", "cannot be decoded")), name


POSTSCRIPT = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 640 480\n%%EndComments\nshowpage\n"


def test_formats_that_no_camera_writes_are_not_decoded(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    write_photos(folder)
    (folder / "a.jpg").write_bytes(POSTSCRIPT)
    picture(5).save(folder / "b.gif")
    (folder / "b.gif").rename(folder / "b.jpg")
    picture(6).save(folder / "c.jp2")
    (folder / "c.jp2").rename(folder / "c.png")
    reasons = skipped_reasons(ingested(tmp_path, folder))
    assert reasons.keys() == {"a.jpg", "b.jpg", "c.png"}
    assert all(reason.startswith("not an image that is read here") for reason in reasons.values())


# Run by the child before it imports anything of ours: decoders that crash, and that are hungry.
_SITE = """
import sys
if "walltopo.reconstruct.ingest.decode_worker" in sys.orig_argv:
    import os, signal
    import walltopo.images.files as opening
    real = opening._open
    def open_or_die(source):
        if "crash" in source.name:
            os.kill(os.getpid(), signal.SIGSEGV)
        if "hungry" in source.name:
            return bytearray(3 << 30)
        return real(source)
    opening._open = open_or_die
"""


def _with_site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import walltopo

    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(_SITE)
    source = str(Path(walltopo.__file__).parents[1])
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'site'}{os.pathsep}{source}")


def test_a_crash_of_a_decoder_costs_its_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _with_site(tmp_path, monkeypatch)
    folder = tmp_path / "in"
    write_photos(folder, 6)
    (folder / "p1.jpg").rename(folder / "crash.jpg")
    (folder / "p4.jpg").rename(folder / "crash2.jpg")
    scan = ingested(tmp_path, folder)
    assert len(list(scan.photos.iterdir())) == 4
    assert skipped_reasons(scan) == dict.fromkeys(
        ("crash.jpg", "crash2.jpg"), "its decoder crashed (SIGSEGV)"
    )


@pytest.mark.skipif(sys.platform != "linux", reason="the limit on memory is Linux's")
def test_who_asks_for_too_much_memory_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _with_site(tmp_path, monkeypatch)
    folder = tmp_path / "in"
    write_photos(folder, 4)
    (folder / "p1.jpg").rename(folder / "hungry.jpg")
    scan = ingested(tmp_path, folder)
    assert "more memory than is allowed" in skipped_reasons(scan)["hungry.jpg"]
    assert len(list(scan.photos.iterdir())) == 3


def test_a_full_disk_is_no_fault_of_the_photo(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    picture(0).save(tmp_path / "a.jpg")
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(EnvironmentLacksError, match="no space left"):
        store_file(0, tmp_path / "a.jpg", tmp_path, IngestSettings(), MemoryBudget())


def test_a_picture_beyond_the_budget_says_so(tmp_path: Path) -> None:
    picture(0).save(tmp_path / "a.png")
    done = store_file(0, tmp_path / "a.png", tmp_path, IngestSettings(), MemoryBudget(2**20))
    assert "more than the 1 MiB that are allowed" in done.reasons[0]


@pytest.mark.slow
def test_pixels_without_end_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    Image.new("1", (30_000, 30_000)).save(tmp_path / "bomb.png")
    with (
        pytest.raises(InputError, match="too large to be a phone photo"),
        decoded_photo(tmp_path / "bomb.png", IngestSettings(), MemoryBudget()),
    ):
        raise AssertionError("it was decoded")


def test_jobs_wait_until_there_is_room() -> None:
    room, order = MemoryBudget(1000), list[str]()
    first, second = threading.Event(), threading.Event()

    def large() -> None:
        with room.reserve(900):
            order.append("large")
            second.set()

    with room.reserve(300), room.reserve(300):
        thread = threading.Thread(target=large)
        thread.start()
        assert not second.wait(0.2)
        order.append("small")
        first.set()
    thread.join()
    assert order == ["small", "large"]
    with pytest.raises(InputError, match="more than"), room.reserve(1001):
        pass


_PEAK = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode
print(code, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="kilobytes are Linux's unit")
def test_memory_does_not_grow_with_the_number_of_huge_photos(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    for k in range(4):
        picture(k, (9000, 9000), 300).save(folder / f"p{k}.png", compress_level=1)
    command = [sys.executable, "-m", "walltopo", "scan", str(folder), "-o", str(tmp_path / "out")]
    wrapper = [sys.executable, "-c", _PEAK, *command, "--to", "ingest"]
    output = subprocess.run(wrapper, capture_output=True, text=True, check=True).stdout
    code, peak = map(int, output.split())
    assert code == 0
    # Four at a time, as they were once decoded, took 4 GB; the largest process here is the child.
    assert peak < BUDGET


def test_the_child_ends_with_its_parent(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "walltopo.reconstruct.ingest.decode_worker"]
    child = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
    )
    assert child.stdin is not None
    os.mkfifo(tmp_path / "film.mp4")  # FFmpeg waits for its other end
    files = f'{{"0": "{_base64(tmp_path / "film.mp4")}"}}'
    job = f'{{"files": {files}, "folder": "{_base64(tmp_path)}", "settings": {{}}, "threads": 1}}'
    child.stdin.write(job.encode() + b"\n")
    child.stdin.flush()
    assert child.stdout is not None
    try:
        assert select.select([child.stdout], [], [], 600)[0], "it did not begin"
        assert b"started" in child.stdout.readline()
        assert child.poll() is None
        child.stdin.close()
        assert child.wait(600) in (1, -signal.SIGKILL)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()
        child.stdout.close()


def _base64(path: Path) -> str:
    import base64

    return base64.b64encode(os.fsencode(path)).decode()
