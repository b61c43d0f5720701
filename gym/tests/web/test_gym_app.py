"""The web app in a real browser, one test per flow: `gym/web/tests`."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import NoReturn
from uuid import UUID

import pytest
from gym.tests.clips.film import tiny_clip
from gym.tests.postgres import free_port
from gym.tests.web.places import (
    WEB,
    backups_of,
    confirm_clips,
    empty_server,
    missing_browser,
    new_world,
    playwright,
    publish_wall,
    report_hold,
    serving,
    set_jobs_aside,
    show_changes,
)
from gym.tests.worlds import Server, World, make_world
from msgspec.structs import replace

from walltopo.pipeline.runner import scan as scan_photos
from walltopo.pipeline.settings import load_settings
from walltopo.scans.folder import ScanFolder
from walltopo.scans.routes import Routes
from walltopo_gym.gyms.members import add_member
from walltopo_gym.gyms.roles import Role
from walltopo_gym.notifications.secrets import unsubscribe_token

pytestmark = pytest.mark.slow

# These begin with a scan in review; the others with a published wall. The longest come first.
IN_REVIEW = ("publishing", "setting", "forms", "capture")
PUBLISHED = (
    "account",
    "competitions",
    "judging",
    "reading",
    "problems",
    "climbing",
    "hall",
    "desk",
    "routes",
    "log",
    "progress",
    "insights",
    "inspections",
    "lists",
    "ropes",
    "clips",
    "moves",
    "holds",
    "apps",
    "operator",
)


def test_every_flow_is_listed() -> None:
    files = {path.name.removesuffix(".spec.mjs") for path in (WEB / "tests").glob("*.spec.mjs")}
    assert files == {*IN_REVIEW, *PUBLISHED}


@pytest.mark.parametrize("flow", [*IN_REVIEW, *PUBLISHED])
def test_flow(
    flow: str,
    tmp_path: Path,
    tiny_photos: Path,
    tiny_scan: Path,
    once: Callable[[str, Callable[[Path], object]], Path],
    lacks: Callable[[str], NoReturn],
) -> None:
    if missing_browser():
        lacks(missing_browser())
    world = new_world(tmp_path / "app")
    member = world.people["member"].id
    assert member is not None
    if flow == "publishing":
        tiny_scan = with_ar_files(tiny_photos, tiny_scan, tmp_path / "scan")
    scan = world.finished(tiny_scan) if flow in IN_REVIEW else publish_wall(world, tiny_scan)
    places: dict[str, object] = {
        "photos": str(tiny_photos),
        "scan": str(scan),
        "mails_link": unsubscribe_token(world.server.database, member),
        **_places_of_one_flow(flow, world, scan, tiny_scan, tmp_path),
    }
    if flow == "clips":
        places["clip"] = str(once("tiny-clip", tiny_clip) / "clip.mp4")
    # Browsers keep the cookie of a sign-in over HTTPS and on this name only; a passkey is for the
    # server's own address.
    port = free_port()
    with ExitStack() as servers:
        if flow == "operator":
            backups = backups_of(world.server.settings.data)
            backups.mkdir()
            empty = empty_server(tmp_path / "empty", backups, free_port())
            places["empty"] = servers.enter_context(empty)
        environment = servers.enter_context(
            serving(world, port, f"http://localhost:{port}", places)
        )
        playwright(environment, f"{flow}.spec.mjs", f"--output={tmp_path / 'failures'}")


def with_ar_files(photos: Path, folder: Path, copy: Path) -> Path:
    """Copy a scan and export it as the platform's worker does: with the files for phones."""
    shutil.copytree(folder, copy)
    words = ["sparse.threads=1", "texture.size=512", "export.ar_files=true"]
    scan_photos(photos, copy, load_settings(None, words))
    return copy


def _places_of_one_flow(
    flow: str, world: World, scan: UUID, folder: Path, scratch: Path
) -> dict[str, object]:
    """Make what only this flow needs, and return where it is.

    Parameters
    ----------
    scan : the first scan of the wall. folder : of a finished scan.
    """
    if flow == "account":
        return {"later": str(world.finished(folder)), "crowd": _crowd(world.server)}
    if flow == "publishing":
        return {"later": str(world.finished(folder)), "look": str(folder / "wall.glb")}
    if flow in ("desk", "routes"):
        return {"bare": _bare_wall(world.server, folder, scratch)}
    if flow == "inspections":
        return {"photo": str(report_hold(world, scan, scratch))}
    if flow == "clips":
        confirm_clips(world, scan, number=2)
    if flow == "holds":
        show_changes(world, scan)
    if flow == "operator":
        set_jobs_aside(world)
    return {}


def _crowd(server: Server) -> dict[str, str]:
    """Make a gym with more members than a page of the API has; return its owner's address."""
    world = make_world(server)
    people = server.persons(*(f"climber {number:03}" for number in range(230)))
    with server.database.writing() as session:
        for person in people.values():
            assert person.id is not None
            add_member(session, world.gym.id, person.id, Role.MEMBER, person.id)
    return {"gym": world.gym.slug, "owner": world.owner.email}


def _bare_wall(server: Server, folder: Path, scratch: Path) -> dict[str, str]:
    """Make a gym whose wall has no published scan but one in review; return what its test needs.

    The first route of the scan gets a colour that no other one has.
    """
    world = make_world(server, visibility="unlisted")
    scan = world.finished(folder)
    found = Routes.load(ScanFolder(folder).routes)
    first, *others = found.routes
    taken = {route.colour for route in others}
    colour = next(name for name in ("green", "red", "yellow") if name not in taken)
    recoloured = replace(found, routes=(replace(first, colour=colour), *others))
    recoloured.save(scratch / "routes.json")
    server.services.store.put(f"scans/{scan}/routes.json", scratch / "routes.json")
    return {
        "gym": world.gym.slug,
        "wall": str(world.wall.id),
        "scan": str(scan),
        "colour": colour,
        "setter": world.people["setter"].email,
        "member": world.people["member"].email,
    }
