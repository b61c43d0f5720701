"""Photos that come in pieces, twice, damaged, too large or under strange names."""

from __future__ import annotations

import base64
import hashlib
import io
from pathlib import Path
from uuid import UUID

import httpx
import numpy as np
import pytest
from gym.tests.hurried import do_now, forget_jobs, waiting
from gym.tests.running import TUS, Process, announce, browser, offset_of, send
from gym.tests.worlds import Server, World, make_world
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image
from tests.reconstruct.ingest.drawn_people import wall, with_person
from tests.reconstruct.ingest.made_files import picture, write_film

from walltopo_gym.errors import RequestError
from walltopo_gym.jobs.queue import Task
from walltopo_gym.scans.overlap import Overlaps
from walltopo_gym.scans.photo_checks import PhotoChecks
from walltopo_gym.scans.queues import BATCHES
from walltopo_gym.scans.receiving import kept_name, shown_name, suffix_of


def jpeg(seed: int = 0, size: tuple[int, int] = (640, 480), *, located: bool = False) -> bytes:
    """A photo of noise, another one each time; `located`: with a place in its EXIF."""
    noise = Image.effect_noise(size, 60 + seed).convert("RGB")
    exif = Image.Exif()
    if located:
        exif.get_ifd(0x8825)[1] = "N"
        exif[0x010F] = "SecretPhone"
    out = io.BytesIO()
    noise.save(out, "JPEG", exif=exif)
    return out.getvalue()


def coloured_share(pixels: NDArray[np.uint8]) -> float:
    """The share of (n, 3) pixels that are neither grey nor black nor white."""
    return float((pixels.max(axis=1).astype(int) - pixels.min(axis=1) > 30).mean())


class Sender:
    """A setter's phone."""

    def __init__(self, world: World) -> None:
        self.world, self.server = world, world.server
        forget_jobs(world.server)
        self.path = f"{world.path}/scans/{world.scan()}/photos"
        self.client = world.server.client()
        self.client.headers.update(world.people["setter"].headers)
        self.client.base_url = httpx.URL(str(self.client.base_url) + "/api/v1")

    def send(self, content: bytes, name: str = "IMG_1.jpg") -> httpx.Response:
        place = announce(self.client, self.path, name, content).headers["location"]
        return send(self.client, place, content)

    def looked_at(self) -> list[dict[str, object]]:
        checks = PhotoChecks(self.server.database, self.server.services.store)
        while waiting(self.server, BATCHES.name):
            do_now(self.server, Task(BATCHES, checks.check_batch))
        photos: list[dict[str, object]] = self.client.get(self.path).json()
        return photos


@pytest.fixture
def phone(world: World) -> Sender:
    return Sender(world)


def test_a_photo_in_three_pieces_is_stored_as_it_was(phone: Sender) -> None:
    content = jpeg(1)
    answer = announce(phone.client, phone.path, "IMG_1.jpg", content)
    assert answer.status_code == 201
    place = answer.headers["location"]
    for end in (100, 5000, len(content)):
        offset = offset_of(phone.client, place)
        answer = send(phone.client, place, content[:end], offset)
        assert (answer.status_code, answer.headers["upload-offset"]) == (204, str(end))
        assert answer.headers["tus-resumable"] == "1.0.0"
    kept = phone.server.services.store.read(f"originals/{hashlib.sha256(content).hexdigest()}")
    assert kept == content
    assert phone.looked_at()[0]["state"] == "usable"


def test_a_photo_that_is_here_is_not_sent_again(phone: Sender) -> None:
    """The tab was closed: announced again it is the same one, as far as it came."""
    content = jpeg(2)
    place = announce(phone.client, phone.path, "IMG_1.jpg", content).headers["location"]
    send(phone.client, place, content[:700])
    again = announce(phone.client, phone.path, "IMG_1.jpg", content)
    assert again.headers["location"] == place
    assert again.headers["upload-offset"] == "700"
    send(phone.client, place, content, 700)
    whole = announce(phone.client, phone.path, "other.jpg", content)
    assert whole.headers["upload-offset"] == str(len(content))
    assert len(phone.looked_at()) == 1


def test_a_wrong_offset_and_too_many_bytes_are_refused(phone: Sender) -> None:
    content = jpeg(3)
    place = announce(phone.client, phone.path, "IMG_1.jpg", content).headers["location"]
    assert send(phone.client, place, content, 10).status_code == 409
    assert send(phone.client, place, content + b"more").status_code == 413
    assert offset_of(phone.client, place) <= len(content)


def test_content_that_was_not_announced_is_forgotten(phone: Sender) -> None:
    content = jpeg(4)
    place = announce(phone.client, phone.path, "IMG_2.jpg", content).headers["location"]
    answer = send(phone.client, place, content[:-1] + bytes([content[-1] ^ 1]))
    assert answer.status_code == 422
    assert "differs from its announced hash" in answer.json()["title"]
    assert phone.client.head(place.partition("/api/v1")[2], headers=TUS).status_code == 404


def test_what_others_see_has_no_place_and_no_phone(phone: Sender) -> None:
    content = jpeg(6, located=True)
    assert b"SecretPhone" in content
    phone.send(content)
    photo = phone.looked_at()[0]
    seen = phone.client.get(f"{phone.world.path}/photos/{photo['id']}/thumbnail")
    assert seen.headers["content-type"] == "image/jpeg"
    assert seen.headers["x-content-type-options"] == "nosniff"
    with Image.open(io.BytesIO(seen.content)) as picture:
        assert dict(picture.getexif()) == {}
        assert max(picture.size) <= 480


def test_a_thumbnail_shows_nobody(phone: Sender) -> None:
    photo, body = with_person(wall(1), 500, 300, 500)
    out = io.BytesIO()
    Image.fromarray(photo).save(out, "JPEG", quality=95)
    phone.send(out.getvalue())
    (entry,) = phone.looked_at()
    assert entry["state"] == "usable"
    seen = phone.client.get(f"{phone.world.path}/photos/{entry['id']}/thumbnail")
    with Image.open(io.BytesIO(seen.content)) as picture:
        large = np.asarray(picture.resize((photo.shape[1], photo.shape[0])))
    assert coloured_share(photo[body]) > 0.5
    assert coloured_share(large[body]) < 0.02


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"<html><script>alert(1)</script></html>", "not an image"),
        (jpeg(7)[:3000], "damaged"),
        (jpeg(8, (100, 100)), "smaller than"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n", "not an image"),
    ],
)
def test_unusable_files_are_reported(phone: Sender, content: bytes, reason: str) -> None:
    phone.send(content)
    photo = phone.looked_at()[0]
    assert photo["state"] == "unusable"
    assert reason in str(photo["reason"])


def test_the_same_photo_under_another_name_is_reported(world: World) -> None:
    """One that its phone could not hash beforehand."""
    phone, content = Sender(world), jpeg(9)
    phone.send(content, "first.jpg")
    name = base64.b64encode(b"second.jpg").decode()
    headers = TUS | {"upload-length": str(len(content)), "upload-metadata": f"filename {name}"}
    place = phone.client.post(phone.path, headers=headers).headers["location"]
    send(phone.client, place, content)
    states = {photo["name"]: (photo["state"], photo["reason"]) for photo in phone.looked_at()}
    assert states["first.jpg"] == ("usable", "")
    assert states["second.jpg"] == ("unusable", "the same photo as first.jpg")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"upload-length": "10000000000"}, 413),
        ({"upload-length": "-1"}, 422),
        ({"upload-length": "99999999999999999999"}, 422),
        ({"upload-metadata": "filename !!!"}, 422),
        ({"upload-metadata": "other YQ=="}, 422),
        ({"upload-metadata": f"filename {base64.b64encode(b'a.svg').decode()}"}, 422),
        ({"upload-metadata": f"filename {base64.b64encode(b'a.jpg/').decode()}"}, 422),
        ({"upload-metadata": f"filename {base64.b64encode(b'a.jpg/.').decode()}"}, 422),
        ({"upload-metadata": f"filename {base64.b64encode(b'a.jpg' + bytes([92])).decode()}"}, 422),
        ({"tus-resumable": "0.9"}, 412),
    ],
)
def test_announcements_that_make_no_sense(
    phone: Sender, headers: dict[str, str], status: int
) -> None:
    good = TUS | {"upload-length": "5", "upload-metadata": "filename YS5qcGc="}
    answer = phone.client.post(phone.path, headers=good | headers)
    assert answer.status_code == status, answer.text
    assert answer.json()["title"]


@given(st.text(max_size=300))
def test_any_name_is_shown_as_one_line_and_leads_nowhere(name: str) -> None:
    shown = shown_name(name)
    assert "/" not in shown
    assert "\\" not in shown
    assert shown.isprintable()
    assert len(shown) <= 120


@given(st.text(max_size=200), st.sampled_from(["", "/", "/.", "\\", "\n", " ", "/../x.png"]))
def test_what_is_announced_can_be_looked_at(name: str, end: str) -> None:
    """A name that is accepted is kept with the suffix for which it was accepted."""
    try:
        kept = kept_name(f"{name}.jpg{end}")
    except RequestError:
        return
    assert suffix_of(kept) in (".jpg", ".png")
    assert kept == shown_name(kept)


def test_a_name_of_a_mac_is_kept_as_others_write_it() -> None:
    assert kept_name("Gru\u0308n.jpg") == "Gr\u00fcn.jpg"


@pytest.mark.slow
def test_a_killed_server_has_all_that_it_acknowledged(tmp_path: Path) -> None:
    world = make_world(Server(tmp_path))
    world.server.close()
    scan = world.scan()
    content = jpeg(10)
    cookie = world.people["setter"].headers["cookie"].partition("=")[2]
    process = Process(tmp_path, "serve", "--port", "0", workers="0")
    try:
        client = browser(process.first_line, cookie)
        place = announce(client, f"{world.path}/scans/{scan}/photos", "a.jpg", content)
        at = place.headers["location"]
        sent = int(send(client, at, content[:9000]).headers["upload-offset"])
        process.kill()
        process = Process(tmp_path, "serve", "--port", "0", workers="0")
        client = browser(process.first_line, cookie)
        offset = offset_of(client, at)
        assert offset >= sent == 9000
        assert send(client, at, content, offset).status_code == 204
    finally:
        process.stop()
    key = hashlib.sha256(content).hexdigest()
    assert (tmp_path / "files" / "originals" / key).read_bytes() == content


@pytest.mark.slow
def test_a_video_is_as_many_photos_as_are_taken_of_it(phone: Sender, tmp_path: Path) -> None:
    made = tmp_path / "walk.mp4"
    write_film(made, frames=60)
    phone.send(made.read_bytes(), "walk.mp4")
    (video,) = phone.looked_at()
    assert video["state"] == "usable"
    assert isinstance(video["frames"], int)
    assert video["frames"] > 3
    # Enough for a scan, which is given the video itself.
    assert phone.client.post(phone.path.replace("/photos", "/start")).status_code == 200


def test_photos_without_overlap_are_listed_before_the_scan(phone: Sender) -> None:
    wall, other = picture(1, (900, 480)), picture(2)
    shown = [wall.crop((left, 0, left + 640, 480)) for left in (0, 130, 260)]
    for number, seen in enumerate((*shown, other)):
        out = io.BytesIO()
        seen.save(out, "JPEG")
        phone.send(out.getvalue(), f"{number}.jpg")
    names = {photo["id"]: photo["name"] for photo in phone.looked_at()}
    path = phone.path.replace("/photos", "/overlap")
    nothing: dict[str, object] = {"pending": True, "groups": [], "shifts": [], "gaps": []}
    assert phone.client.get(path).json() == nothing
    overlaps = Overlaps(phone.server.database, phone.server.services.store)
    scan = phone.path.split("/")[-2]
    overlaps.answer(scan, number=4)
    payload = phone.client.get(path).json()
    assert payload["pending"] is False
    assert [[names[photo] for photo in group] for group in payload["groups"]] == [
        ["0.jpg", "1.jpg", "2.jpg"],
        ["3.jpg"],
    ]
    ((apart, near),) = payload["gaps"]
    assert names[apart] == "3.jpg"
    assert names[near] in {"0.jpg", "1.jpg", "2.jpg"}
    # The crops lie 130 px to the right of each other, of 640 px.
    steps = {(names[step["before"]], names[step["after"]]): step for step in payload["shifts"]}
    assert steps.keys() == {("0.jpg", "1.jpg"), ("1.jpg", "2.jpg")}
    for step in steps.values():
        assert (step["right"], step["up"]) == pytest.approx((130 / 640, 0.0), abs=0.01)
    # Taken back, what was said is to be found out anew; a late answer to the first asking is none.
    last = next(photo for photo, name in names.items() if name == "3.jpg")
    phone.client.delete(f"{phone.world.path}/photos/{last}", headers=TUS)
    overlaps.answer(scan, number=4)
    assert phone.client.get(path).json()["pending"] is True


def test_a_photo_complete_before_a_database_failure_is_stored_later(
    phone: Sender,
) -> None:
    for number, ask in enumerate((announce, None)):
        content = jpeg(20 + number)
        place = announce(phone.client, phone.path, f"{number}.jpg", content).headers["location"]
        send(phone.client, place, content[:100])
        # As a server does that has no database any more: the bytes are here, the row says nothing.
        incoming = phone.server.incoming
        with incoming.appending(UUID(place.rpartition("/")[2]), 100) as stream:
            stream.write(content[100:])
        if ask:
            ask(phone.client, phone.path, f"{number}.jpg", content)
        else:
            assert offset_of(phone.client, place) == len(content)
    assert [photo["state"] for photo in phone.looked_at()] == ["usable", "usable"]
