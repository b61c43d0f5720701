"""The clients that a release publishes, made from the API's document, against a live server."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

import pytest
from gym.tests.postgres import free_port
from gym.tests.running import Process
from gym.tests.web.places import WEB, new_world
from gym.tests.worlds import Server, World, hold
from tools.clients import make_clients, named_schemas

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.server.app import build_app

_PYTHON = """
import sys
from walltopo_gym_client import AuthenticatedClient, Client
from walltopo_gym_client.api.climbing import read_logbook
from walltopo_gym_client.api.gyms import list_gyms
from walltopo_gym_client.api.routes import list_routes

address, gym, token = sys.argv[1:]
guest = Client(base_url=address)
print([one.slug for one in list_gyms.sync(client=guest).items])
print([one.name for one in list_routes.sync(gym, client=guest)])
own = AuthenticatedClient(base_url=address, token=token)
print(read_logbook.sync_detailed(gym, client=guest).status_code.value)
print(read_logbook.sync_detailed(gym, client=own).status_code.value)
"""

_NODE = """
import { createGym } from "@walltopo/gym";

const [address, gym, token] = process.argv.slice(2);
const params = { path: { gym } };
const guest = createGym(address);
const own = createGym(address, { token });
const { data: gyms } = await guest.GET("/api/v1/gyms");
console.log(gyms.items.map(({ slug }) => slug));
const { data: routes } = await guest.GET("/api/v1/gyms/{gym}/routes", { params });
console.log(routes.map(({ name }) => name));
console.log((await guest.GET("/api/v1/gyms/{gym}/logbook", { params })).response.status);
console.log((await own.GET("/api/v1/gyms/{gym}/logbook", { params })).response.status);
"""

_TYPES = """
import { createGym, type Schemas } from "@walltopo/gym";

const gym = createGym("https://walls.gym.example", { token: "wtg_" });
const { data } = await gym.GET("/api/v1/gyms/{gym}/routes", { params: { path: { gym: "hall" } } });
export const grades: string[] = (data ?? []).map((route: Schemas["RouteOut"]) => route.grade);
// @ts-expect-error the API has no such address
await gym.GET("/api/v1/none");
"""


def test_names_of_schemas_are_names_of_classes(server: Server) -> None:
    document = named_schemas(build_app(server.services).openapi())
    schemas = document["components"]["schemas"]
    assert all(name.isidentifier() and schema["title"] == name for name, schema in schemas.items())
    text = json.dumps(document)
    for name in ("GradeInput", "GradeOutput", "ClimbingKindsKind"):
        assert f'"#/components/schemas/{name}"' in text


@pytest.fixture(scope="module")
def clients(tmp_path_factory: pytest.TempPathFactory, lacks: Callable[[str], NoReturn]) -> Path:
    """The folder of both packages."""
    if find_spec("openapi_python_client") is None:
        lacks("openapi-python-client is not installed (pip install '.[release]')")
    if shutil.which("npm") is None or not (WEB / "node_modules").is_dir():
        lacks("npm or gym/web/node_modules is missing (make browser)")
    folder = tmp_path_factory.mktemp("clients")
    make_clients(folder)
    return folder


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[World, list[str]]]:
    """A served gym with a route; its address, its slug and a token of its member."""
    data = tmp_path_factory.mktemp("live") / "data"
    world = new_world(data)
    scan = world.reviewed({1: [1]}, [hold(1, 0.0, 1.0)])
    assert world.publish(scan, {"number": 1, "name": "Moon"}).is_success
    token = world.server.token(world.people["member"], Scope.READ)
    secret = token.headers["authorization"].removeprefix("Bearer ")
    world.server.close()
    port = free_port()
    address = f"http://localhost:{port}"
    process = Process(data, "serve", "--port", str(port), address=address, workers="0")
    yield world, [address, world.gym.slug, secret]
    process.stop()


def npm_package(clients: Path, folder: Path) -> None:
    """Unpack the npm package into a project, beside what it depends on."""
    (packed,) = clients.glob("walltopo-gym-*.tgz")
    modules = folder / "node_modules"
    with tarfile.open(packed) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (modules / "@walltopo").mkdir(parents=True)
    (folder / "unpacked" / "package").rename(modules / "@walltopo" / "gym")
    for name in ("openapi-fetch", "openapi-typescript-helpers"):
        (modules / name).symlink_to(WEB / "node_modules" / name)


@pytest.mark.slow
def test_the_wheel_reads_a_gym(
    clients: Path, live: tuple[World, list[str]], tmp_path: Path
) -> None:
    (wheel,) = clients.glob("walltopo_gym_client-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
    (tmp_path / "use.py").write_text(_PYTHON, encoding="utf-8")
    path = os.pathsep.join(filter(None, (str(tmp_path), os.environ.get("PYTHONPATH"))))
    check([sys.executable, "use.py", *live[1]], tmp_path, live[0], PYTHONPATH=path)


@pytest.mark.slow
def test_the_npm_package_reads_a_gym(
    clients: Path, live: tuple[World, list[str]], tmp_path: Path
) -> None:
    npm_package(clients, tmp_path)
    (tmp_path / "use.mjs").write_text(_NODE, encoding="utf-8")
    check(["node", "use.mjs", *live[1]], tmp_path, live[0])
    (tmp_path / "use.mts").write_text(_TYPES, encoding="utf-8")
    options = ["--noEmit", "--strict", "--module", "nodenext", "--target", "es2022"]
    typescript = WEB / "node_modules" / ".bin" / "tsc"
    done = subprocess.run(
        [typescript, *options, "use.mts"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


def check(command: list[str], folder: Path, world: World, **more: str) -> None:
    """Run a program that prints gyms, routes, and the statuses of a guest and of a member."""
    done = subprocess.run(
        command, cwd=folder, env=os.environ | more, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    gyms, routes, guest, member = done.stdout.replace(" ", "").replace('"', "'").splitlines()
    assert (gyms, routes) == (f"['{world.gym.slug}']", "['Moon']")
    assert (guest, member) == ("401", "200")
