"""Collect all settings of a scan from defaults, `walltopo.toml` and `--set`."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core import SettingField, SettingsError, settings_of
from walltopo.core.files import read_toml
from walltopo.core.settings import checked_value, known_setting, override
from walltopo.describe.settings import ClassifySettings, RoutesSettings
from walltopo.editing.settings import EditSettings
from walltopo.publish.settings import ExportSettings
from walltopo.reconstruct.settings import (
    DenseSettings,
    IngestSettings,
    ScaleSettings,
    SparseSettings,
    TextureSettings,
)
from walltopo.segment.lift.settings import FOR_DETECTIONS, LiftParams
from walltopo.segment.settings import DetectSettings, ProposeSettings


@dataclass(frozen=True)
class Settings:
    """All settings, one section per stage; each field declares its help, unit and range."""

    ingest: IngestSettings = field(default_factory=IngestSettings)
    sparse: SparseSettings = field(default_factory=SparseSettings)
    scale: ScaleSettings = field(default_factory=ScaleSettings)
    dense: DenseSettings = field(default_factory=DenseSettings)
    texture: TextureSettings = field(default_factory=TextureSettings)
    detect: DetectSettings = field(default_factory=DetectSettings)
    lift: LiftParams = field(default_factory=lambda: FOR_DETECTIONS)
    propose: ProposeSettings = field(default_factory=ProposeSettings)
    classify: ClassifySettings = field(default_factory=ClassifySettings)
    routes: RoutesSettings = field(default_factory=RoutesSettings)
    edit: EditSettings = field(default_factory=EditSettings)
    export: ExportSettings = field(default_factory=ExportSettings)

    def __post_init__(self) -> None:
        if self.dense.mesh and not self.sparse.poses:
            raise SettingsError(
                "dense.mesh needs sparse.poses: the poses of the photos in the frame of the mesh",
                "Give --poses with the file or folder that the app exported with the mesh.",
            )

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """Return plain JSON-serialisable values by section and key."""
        plain = msgspec.to_builtins(self)
        return {section: plain[section] for section in SECTIONS}


SECTIONS = tuple(f.name for f in dataclasses.fields(Settings))


def sections() -> Mapping[str, Mapping[str, SettingField]]:
    """Return every declared setting by section and name, with a scan's defaults."""
    defaults = Settings()
    found = {}
    for name in SECTIONS:
        section = getattr(defaults, name)
        fields = settings_of(type(section))
        found[name] = {
            key: dataclasses.replace(field, default=getattr(section, key))
            for key, field in fields.items()
        }
    return found


def load_settings(
    file: Path | None = None, overrides: Sequence[str] = (), *, programs: bool = True
) -> Settings:
    """Return the defaults, overridden by a TOML file, then by `section.key=value` texts.

    Parameters
    ----------
    programs : whether the file may name programs to run. A file that was merely found in the
        working folder may not, because it may have come with somebody else's photos.

    Raises
    ------
    SettingsError : an unknown key (the message suggests the nearest one), a value of the wrong type
        or out of range, or a program named by a file that may not.
    InputError : the file is missing or not TOML.

    Examples
    --------
    >>> load_settings(None, ["texture.size=2048"]).texture.size
    2048
    """
    values: dict[str, dict[str, Any]] = {}
    if file is not None:
        for key, value in _entries(file):
            _store_value(values, key, value, str(file))
            if not programs:
                _refuse_program(key, value, file)
    for text in overrides:
        key, value = override(text)
        _store_value(values, key, value, "--set")
    sections = {}
    for f in dataclasses.fields(Settings):
        default = getattr(Settings(), f.name)
        sections[f.name] = dataclasses.replace(default, **values.get(f.name, {}))
    return Settings(**sections)


def allowed(field: SettingField) -> str:
    """Return a setting's allowed values in words; "" if the type says everything."""
    if field.choices:
        return ", ".join(field.choices)
    ends = ("" if end is None else str(end) for end in (field.low, field.high))
    return "" if field.low is None and field.high is None else " .. ".join(ends).strip()


def settings_markdown() -> str:
    """Return `docs/settings.md`: two tables per section, the second for expert settings."""
    lines = [
        "# Settings",
        "",
        "Written by `make docs`. Set them in `walltopo.toml` (in the working folder, or given by",
        "`--config`) or with `--set section.key=value`. An unknown key is an error.",
        "",
        f"{_programs()} name programs to run.",
        "`walltopo.toml` in the working folder cannot set them, because the file may have come with",
        "another person's photos. Use `--config FILE` or `--set` for these.",
        "",
        "Each section has a table of common settings. A second table, if present, has expert",
        "settings, which `walltopo settings --all` lists.",
    ]
    for section, fields in sections().items():
        lines += ["", f"## {section}"]
        for expert in (False, True):
            rows = [row for row in fields.values() if row.expert == expert]
            if rows:
                lines += ["", "| key | default | what | unit | allowed |", "|---|---|---|---|---|"]
            for row in rows:
                text = row.text.replace("|", "\\|")
                lines.append(
                    f"| `{row.name}` | `{row.default}` | {text} | {row.unit} | {allowed(row)} |"
                )
    return "\n".join(lines) + "\n"


def _programs() -> str:
    """Return a list in words of the settings that name programs."""
    keys = [
        f"`{s}.{n}`" for s, fields in sections().items() for n, f in fields.items() if f.program
    ]
    return ", ".join(keys[:-1]) + f" and {keys[-1]}"


def _entries(file: Path) -> Iterator[tuple[str, Any]]:
    """Yield key and value of each entry of a settings file."""
    hint = "`walltopo settings` writes one to start from."
    for section, content in read_toml(file, hint).items():
        if not isinstance(content, dict):
            raise SettingsError(f"{file}: {section} stands outside a section such as [lift]")
        for key, value in content.items():
            yield f"{section}.{key}", value


def _refuse_program(key: str, value: object, file: Path) -> None:
    """Raise SettingsError if the entry names a program to run."""
    section, _, name = key.partition(".")
    if sections()[section][name].program and value:
        raise SettingsError(
            f"{file}: {key} leads to a program that would be run, which a file found in the "
            "working folder may not name",
            f"If you trust it, say --config {file}, or --set {key}=...",
        )


def _store_value(values: dict[str, dict[str, Any]], key: str, value: object, origin: str) -> None:
    """Check one value and store it in `values`."""
    section, _, name = key.partition(".")
    known = {f"{s}.{n}": field for s, fields in sections().items() for n, field in fields.items()}
    field = known_setting(known, key, origin)
    values.setdefault(section, {})[name] = checked_value(value, field, f"{origin}: {key}")
