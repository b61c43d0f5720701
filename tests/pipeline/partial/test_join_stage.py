"""The stage `join` of a partial rescan: run again, healed, and read by the stages after it."""

from __future__ import annotations

import shutil
from contextlib import suppress
from pathlib import Path

import pytest

from walltopo.core import InputError
from walltopo.core.files import hash_path
from walltopo.pipeline.health import stages_health
from walltopo.pipeline.runner import refresh, run_stage, scan, stored_settings
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stages.join import PART, REFERENCE
from walltopo.scans.edits import EditLog, Ref, Remove
from walltopo.scans.folder import ScanFolder, read_edits, read_joined
from walltopo.scans.holds import Holds
from walltopo.scans.manifest import Manifest

pytestmark = pytest.mark.slow


@pytest.fixture
def joined(reset_day: Path, tmp_path: Path) -> ScanFolder:
    """A copy of the partial rescan."""
    # Links to the photos as they were aligned lead nowhere since the folder moved.
    return ScanFolder(shutil.copytree(reset_day / "joined", tmp_path / "joined", symlinks=True))


def _bring_reference_back(folder: ScanFolder, reset_day: Path) -> None:
    """Let the reference be where it was when the rescan was made; the fixture has moved it."""
    then = Path(stored_settings(folder).sparse.reference)
    then.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileExistsError):
        then.symlink_to(reset_day / "old", target_is_directory=True)


def _again(folder: ScanFolder, **options: str) -> tuple[str, ...]:
    return scan([], folder.root, stored_settings(folder), **options).ran  # type: ignore[arg-type]


def _states(folder: ScanFolder) -> set[str]:
    return {found.state for found in stages_health(folder)}


def _log(folder: ScanFolder, *, of: tuple[int, ...]) -> EditLog:
    """A log that removes one of some holds."""
    hold = next(hold for hold in Holds.load(folder.holds).holds if hold.id in of)
    return EditLog(edits=(Remove(hold=Ref(hold.id, hold.position)),))


def test_it_runs_once_also_without_its_reference(joined: ScanFolder) -> None:
    assert _again(joined) == ()
    assert _states(joined) == {"done"}


def test_a_damaged_wall_is_joined_again(joined: ScanFolder, reset_day: Path) -> None:
    _bring_reference_back(joined, reset_day)
    whole = hash_path(joined.mesh)
    joined.mesh.write_bytes(joined.mesh.read_bytes()[:-9])
    assert "damaged" in _states(joined)
    assert _again(joined) == ("join",)
    assert hash_path(joined.mesh) == whole
    assert [path.name for path in (joined.root / "set-aside").iterdir()] == ["mesh.ply"]


def test_an_edit_outlives_a_second_join(joined: ScanFolder, reset_day: Path) -> None:
    _bring_reference_back(joined, reset_day)
    found = read_joined(joined)
    assert found is not None
    log = _log(joined, of=found.added)
    log.save(joined.edits)
    assert _again(joined, to_stage="edit") == ("edit",)
    assert _again(joined, from_stage="join", to_stage="edit") == ("join", "edit")
    assert EditLog.load(joined.edits) == log
    assert log.edits[0].hold.id not in {hold.id for hold in Holds.load(joined.holds).holds}  # type: ignore[union-attr]


def test_edits_of_the_reference_are_carried_over(
    joined: ScanFolder, reset_day: Path, tmp_path: Path
) -> None:
    found = read_joined(joined)
    assert found is not None
    reference = ScanFolder(shutil.copytree(reset_day / "old", tmp_path / "old", symlinks=True))
    log = _log(reference, of=found.stays)
    log.save(reference.edits)
    settings = stored_settings(joined)
    others = {PART: joined.part, REFERENCE: reference}
    run_stage(joined, "join", settings.sparse, others=others)
    carried = ScanFolder.carried.load(joined)
    assert carried is not None
    (entry,) = carried.edits
    assert isinstance(entry, Remove)
    assert entry.hold.id == log.edits[0].hold.id  # type: ignore[union-attr]
    assert read_edits(joined) == carried
    run_stage(joined, "edit", settings.edit)
    assert entry.hold.id not in {hold.id for hold in Holds.load(joined.holds).holds}
    # The scan's own log replaces them: there they can be undone.
    EditLog().save(joined.edits)
    run_stage(joined, "edit", settings.edit)
    assert entry.hold.id in {hold.id for hold in Holds.load(joined.holds).holds}


def test_other_settings_do_not_turn_it_into_a_whole_scan(joined: ScanFolder) -> None:
    with pytest.raises(InputError, match="is a partial rescan"):
        scan([], joined.root, Settings())


def test_a_scan_that_an_older_version_joined_in_place(joined: ScanFolder, reset_day: Path) -> None:
    manifest, found = Manifest.load(joined.manifest), read_joined(joined)
    del manifest.stages["join"]
    manifest.joined = found
    manifest.save(joined.manifest)
    joined.part.sources.rename(joined.sources)
    shutil.rmtree(joined.part.root)
    joined.joined.unlink()
    assert read_joined(joined) == found
    assert _states(joined) == {"done"}
    assert _again(joined) == ()
    joined.report.unlink()
    assert refresh(joined, ["edit", "export"]) == ["export"]
    with pytest.raises(InputError, match="an older walltopo joined"):
        _again(joined, from_stage="dense")
    with pytest.raises(InputError, match="photos cannot change"):
        scan(reset_day / "before/photos", joined.root, stored_settings(joined))
