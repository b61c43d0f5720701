"""What runs again and what is kept, with three small stages in place of the real ones."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from walltopo.core import EnvironmentLacksError, InputError, Progress, StageError
from walltopo.core.files import atomic_path, read_json, write_json
from walltopo.pipeline.runner import Stage, scan
from walltopo.pipeline.settings import Settings
from walltopo.scans.folder import ScanFolder


class Pipeline:
    """ingest -> sparse -> routes, each writing one small file from the one before."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.fail: BaseException | None = None

    def ingest(
        self, scan: ScanFolder, settings: Any, progress: Progress, sources: Sequence[Path]
    ) -> dict[str, Any]:
        self.ran.append("ingest")
        with atomic_path(scan.photos) as folder:
            folder.mkdir()
            for source in sources:
                (folder / source.name).write_bytes(source.read_bytes())
        write_json(scan.photo_list, {"photos": len(sources)})
        return {"photos": len(sources)}

    def sparse(self, scan: ScanFolder, settings: Any, progress: Progress) -> dict[str, Any]:
        self.ran.append("sparse")
        if self.fail is not None:
            raise self.fail
        # Only the first letters count: an input may change without changing this output.
        text = "".join(sorted(p.read_text()[0] for p in scan.photos.iterdir()))
        with atomic_path(scan.sparse_raw) as path:
            path.write_text(text)
        return {"letters": text}

    def routes(self, scan: ScanFolder, settings: Any, progress: Progress) -> dict[str, Any]:
        self.ran.append("routes")
        write_json(scan.routes, {"text": scan.sparse_raw.read_text()})
        return {}


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> Pipeline:
    fake = Pipeline()
    stages = []
    for name, reads, writes in (
        ("ingest", (), ("photos", "photo_list")),
        ("sparse", ("photos",), ("sparse_raw",)),
        ("routes", ("sparse_raw",), ("routes",)),
    ):
        module = ModuleType(f"fake_{name}")
        module.run = getattr(fake, name)  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, f"fake_{name}", module)
        stages.append(Stage(name, f"fake_{name}", reads, writes))
    monkeypatch.setattr("walltopo.pipeline.runner.STAGES", tuple(stages))
    return fake


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    path = tmp_path / "a.jpg"
    path.write_text("alpha")
    return path


def test_a_second_run_computes_nothing(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    first = scan(photo, tmp_path / "scan")
    second = scan(photo, tmp_path / "scan")
    assert first.ran == ("ingest", "sparse", "routes")
    assert second.ran == ()
    assert second.metrics["sparse"] == {"letters": "a"}


def test_a_change_runs_what_depends_on_it(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    scan(photo, tmp_path / "scan")
    photo.write_text("beta")
    assert scan(photo, tmp_path / "scan").ran == ("ingest", "sparse", "routes")
    photo.write_text("bravo")  # another photo, the same sparse model
    assert scan(photo, tmp_path / "scan").ran == ("ingest", "sparse")


def test_a_setting_runs_its_stage(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    scan(photo, tmp_path / "scan")
    settings = Settings()
    changed = replace(settings, ingest=replace(settings.ingest, min_side=100))
    assert scan(photo, tmp_path / "scan", changed).ran == ("ingest",)


def test_a_missing_output_is_made_again(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    folder = scan(photo, tmp_path / "scan").folder
    folder.sparse_raw.unlink()
    assert scan(photo, tmp_path / "scan").ran == ("sparse",)


def test_from_to_force(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "scan"
    assert scan(photo, out, to_stage="sparse").ran == ("ingest", "sparse")
    assert scan(photo, out, from_stage="sparse", to_stage="sparse").ran == ("sparse",)
    assert scan(photo, out, force=True).ran == ("ingest", "sparse", "routes")
    with pytest.raises(InputError, match="unknown stage 'spare'"):
        scan(photo, out, from_stage="spare")
    with pytest.raises(InputError, match="comes after"):
        scan(photo, out, from_stage="routes", to_stage="ingest")


@pytest.mark.parametrize(
    ("error", "state"),
    [
        (StageError("no luck"), "failed"),
        (KeyboardInterrupt(), "interrupted"),
        (RuntimeError("a defect"), "failed"),
    ],
)
def test_failures_are_recorded_and_resumed(
    pipeline: Pipeline, photo: Path, tmp_path: Path, error: BaseException, state: str
) -> None:
    pipeline.fail = error
    with pytest.raises(type(error)):
        scan(photo, tmp_path / "scan")
    assert read_json(tmp_path / "scan" / "scan.json")["stages"]["sparse"]["state"] == state
    pipeline.fail = None
    assert scan(photo, tmp_path / "scan").ran == ("sparse", "routes")


def test_sources_are_remembered_even_when_moved(
    pipeline: Pipeline, photo: Path, tmp_path: Path
) -> None:
    out = tmp_path / "scan"
    scan(photo, out)
    assert scan([], out).ran == ()
    photo.unlink()
    assert scan([], out, from_stage="routes").ran == ("routes",)
    with pytest.raises(InputError, match="no photos given"):
        scan([], tmp_path / "other")


def test_a_foreign_folder_is_left_alone(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "thesis"
    out.mkdir()
    (out / "chapter.txt").write_text("years of work")
    with pytest.raises(InputError, match="not empty and not a scan folder"):
        scan(photo, out)
    assert [p.name for p in out.iterdir()] == ["chapter.txt"]
    with pytest.raises(InputError, match="is a file"):
        scan(photo, photo)


def test_two_runs_at_once_are_refused(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "scan"
    caught: list[BaseException] = []

    def again(*_: Any) -> dict[str, Any]:
        try:
            scan(photo, out)
        except EnvironmentLacksError as error:
            caught.append(error)
        return {}

    sys.modules["fake_routes"].run = again  # type: ignore[attr-defined]
    scan(photo, out)
    assert "another walltopo is at work" in str(caught[0])


def test_half_written_leftovers_are_swept(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "scan"
    (out / ".partial-abc").mkdir(parents=True)
    scan(photo, out)
    assert not list(out.glob(".partial-*"))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "not valid JSON"),
        ('{"version": 99}', "newer walltopo"),
        ('{"version": 1}', "not a walltopo manifest"),
    ],
)
def test_a_damaged_manifest_is_told(
    pipeline: Pipeline, photo: Path, tmp_path: Path, content: str, message: str
) -> None:
    out = tmp_path / "scan"
    out.mkdir()
    (out / "scan.json").write_text(content)
    with pytest.raises(InputError, match=message):
        scan(photo, out)


def test_a_reference_counts_by_what_is_used_of_it_and_a_choice_is_no_path(
    pipeline: Pipeline, photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    reference = tmp_path / "reference"
    (reference / "sparse").mkdir(parents=True)
    (reference / "report.html").write_text("old")
    settings = Settings()
    settings = replace(settings, sparse=replace(settings.sparse, reference=str(reference)))
    scan(photo, tmp_path / "scan", settings)
    pipeline.ran.clear()
    (reference / "report.html").write_text("new")
    Path(settings.sparse.align).mkdir()  # a folder named like the choice
    scan(photo, tmp_path / "scan", settings)
    assert pipeline.ran == []
    (reference / "sparse" / "cameras.bin").write_text("moved")
    scan(photo, tmp_path / "scan", settings)
    assert pipeline.ran == ["sparse"]
