"""A run repeats or keeps results, tested with three small stages instead of the real ones."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from walltopo.core import EnvironmentLacksError, InputError, StageError
from walltopo.core.files import read_json, shipped_file
from walltopo.pipeline import plan, stages
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoList, PhotoSet, SourceList
from walltopo.scans.routes import Route, Routes
from walltopo.scans.scale import Aligned, Frame


@dataclass(frozen=True)
class IngestReads:
    sources: SourceList = of(ScanFolder.sources)


@dataclass(frozen=True)
class IngestWrites:
    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    metrics: Metrics = figures()


@dataclass(frozen=True)
class SparseReads:
    photos: PhotoSet = of(ScanFolder.photos)


@dataclass(frozen=True)
class SparseWrites:
    sparse_raw: SparseModel = of(ScanFolder.sparse_raw)
    aligned: Aligned | None = of(ScanFolder.aligned)
    metrics: Metrics = figures()


@dataclass(frozen=True)
class RoutesReads:
    sparse_raw: SparseModel = of(ScanFolder.sparse_raw)
    aligned: Aligned | None = of(ScanFolder.aligned)


@dataclass(frozen=True)
class RoutesWrites:
    routes: Routes = of(ScanFolder.routes)
    metrics: Metrics = figures()


class Pipeline:
    """ingest -> sparse -> routes, each making a little from what the one before made."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.fail: BaseException | None = None
        self.reference = ""

    def ingest(self, reads: IngestReads, settings: Any, context: Context) -> IngestWrites:
        self.ran.append("ingest")
        folder = context.scratch / "photos"
        folder.mkdir()
        files = [source.file for source in reads.sources.files]
        for source in files:
            (folder / source.name).write_bytes(source.read_bytes())
        photos = tuple(Photo(s.name, 640, 480, None, s.name, 1.0) for s in files)
        return IngestWrites(PhotoSet(folder), PhotoList(photos=photos), {"photos": len(photos)})

    def sparse(self, reads: SparseReads, settings: Any, context: Context) -> SparseWrites:
        self.ran.append("sparse")
        folder = context.scratch / "model"
        folder.mkdir()
        # Only the first letters count: an input may change without changing this output.
        text = "".join(sorted(p.read_text()[0] for p in reads.photos.folder.iterdir()))
        (folder / "images.txt").write_text(text)
        if self.fail is not None:
            raise self.fail
        frame = Frame(metric=True, up_known=True, floor_known=True)
        aligned = Aligned(
            reference=self.reference,
            align="rigid",
            reference_moved=0.0,
            shared_points=9,
            frame=frame,
        )
        kept = aligned if self.reference else None
        return SparseWrites(SparseModel(folder), kept, {"letters": text})

    def routes(self, reads: RoutesReads, settings: Any, context: Context) -> RoutesWrites:
        self.ran.append("routes")
        text = (reads.sparse_raw.folder / "images.txt").read_text()
        reference = reads.aligned.reference if reads.aligned else ""
        return RoutesWrites(Routes(routes=(Route(1, text, reference),)), {})


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> Pipeline:
    fake = Pipeline()
    stages = (
        Stage("ingest", IngestReads, IngestWrites, fake.ingest),
        Stage("sparse", SparseReads, SparseWrites, fake.sparse),
        Stage("routes", RoutesReads, RoutesWrites, fake.routes),
    )
    monkeypatch.setattr("walltopo.pipeline.plan.STAGES", stages)
    monkeypatch.setattr("walltopo.pipeline.stages.STAGES", stages)
    return fake


def route_of(out: Path) -> Route:
    """The one route that the last stage wrote."""
    (route,) = Routes.load(out / "routes.json").routes
    return route


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
    assert route_of(tmp_path / "scan").name == "a"


def test_a_change_runs_what_depends_on_it(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    scan(photo, tmp_path / "scan")
    photo.write_text("beta")
    assert scan(photo, tmp_path / "scan").ran == ("ingest", "sparse", "routes")
    photo.write_text("bravo")  # another photo, the same sparse model
    assert scan(photo, tmp_path / "scan").ran == ("ingest", "sparse")


def test_further_photos_are_added(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    more, out = tmp_path / "c.jpg", tmp_path / "scan"
    more.write_text("charlie")
    with pytest.raises(InputError, match="no scan to add photos to"):
        scan(photo, out, add=True)
    scan(photo, out)
    assert scan(more, out, add=True).ran == ("ingest", "sparse", "routes")
    assert route_of(out).name == "ac"
    assert scan([], out).ran == ()
    assert scan(more, out, add=True).ran == ()
    photo.unlink()
    with pytest.raises(InputError, match=r"a\.jpg: photos of this scan were here"):
        scan(more, out, add=True)
    assert route_of(out).name == "ac"


def test_a_setting_runs_its_stage(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    scan(photo, tmp_path / "scan")
    settings = Settings()
    changed = replace(settings, ingest=replace(settings.ingest, min_side=100))
    assert scan(photo, tmp_path / "scan", changed).ran == ("ingest",)


def test_another_shipped_model_runs_its_stage(
    pipeline: Pipeline, photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = tmp_path / "net.onnx"
    model.write_text("first weights")
    monkeypatch.setattr("walltopo.pipeline.workplace.shipped_file", tmp_path.joinpath)
    used = [
        replace(stage, models=(model.name,)) if stage.name == "sparse" else stage
        for stage in stages.STAGES
    ]
    monkeypatch.setattr("walltopo.pipeline.plan.STAGES", tuple(used))
    scan(photo, tmp_path / "scan")
    assert scan(photo, tmp_path / "scan").ran == ()
    model.write_text("other weights")
    assert scan(photo, tmp_path / "scan").ran == ("sparse",)


def test_every_model_is_some_stages_input() -> None:
    named = {name for stage in stages.STAGES for name in stage.models}
    folder = shipped_file("holds.onnx").parent
    assert named == {path.name for path in folder.iterdir() if path.suffix != ".md"}


def test_a_missing_output_is_made_again(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    folder = scan(photo, tmp_path / "scan").folder
    shutil.rmtree(folder.sparse_raw)
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
    folder = ScanFolder(tmp_path / "scan")
    assert not list(folder.root.rglob(".partial-*")), "what was half made is gone"
    assert not folder.sparse_raw.exists()
    pipeline.fail = None
    assert scan(photo, tmp_path / "scan").ran == ("sparse", "routes")


def test_a_full_disk_is_reported(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    pipeline.fail = OSError(28, "No space left on device")
    with pytest.raises(EnvironmentLacksError, match="space"):
        scan(photo, tmp_path / "scan")


def test_an_optional_output_comes_and_goes(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "scan"
    folder = scan(photo, out).folder
    assert not folder.aligned.exists()
    pipeline.reference = "old gym"
    assert scan(photo, out, from_stage="sparse", to_stage="sparse").ran == ("sparse",)
    assert Aligned.load(folder.aligned).reference == "old gym"
    assert scan(photo, out).ran == ("routes",)
    assert route_of(out).colour == "old gym"
    pipeline.reference = ""
    assert scan(photo, out, from_stage="sparse", to_stage="sparse").ran == ("sparse",)
    assert not folder.aligned.exists(), "the old one is taken away"
    assert scan(photo, out).ran == ("routes",)
    assert route_of(out).colour == ""
    assert scan(photo, out).ran == (), "its absence is no missing output"


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


def test_two_runs_at_once_are_refused(
    pipeline: Pipeline, photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "scan"
    caught: list[BaseException] = []

    def again(*_: Any) -> RoutesWrites:
        try:
            scan(photo, out)
        except EnvironmentLacksError as error:
            caught.append(error)
        return RoutesWrites(Routes(routes=()), {})

    routes = replace(stages.STAGES[2], run=again)
    monkeypatch.setattr(plan, "STAGES", (*stages.STAGES[:2], routes))
    scan(photo, out)
    assert "another walltopo process is working" in str(caught[0])


def test_half_written_leftovers_are_swept(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    out = tmp_path / "scan"
    (out / ".partial-abc").mkdir(parents=True)
    scan(photo, out)
    assert not list(out.glob(".partial-*"))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "JSON"),
        ('{"version": 99}', "newer"),
        ('{"version": 1}', "missing"),
    ],
)
def test_a_damaged_manifest_is_reported(
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
    # A scan outlives its reference.
    shutil.rmtree(reference)
    scan(photo, tmp_path / "scan", settings)
    assert pipeline.ran == ["sparse"]


def test_only_what_ingest_reads_counts(pipeline: Pipeline, photo: Path, tmp_path: Path) -> None:
    """The scan may lie among its photos, and other things beside them."""
    folder = tmp_path / "photos"
    folder.mkdir()
    photo.rename(folder / "a.jpg")
    out = folder / "scan"
    assert scan(folder, out).ran == ("ingest", "sparse", "routes")
    (folder / "backup").mkdir()
    (folder / "backup" / "disk.img").write_bytes(b"large")
    (folder / "list.xlsx").write_bytes(b"other")
    assert scan(folder, out).ran == ()
    (folder / "b.jpg").write_text("beta")
    assert scan(folder, out).ran == ("ingest", "sparse", "routes")
