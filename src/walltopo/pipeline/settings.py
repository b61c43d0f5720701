"""All settings of a scan in one typed object, from defaults, `walltopo.toml` and `--set`."""

from __future__ import annotations

import dataclasses
import difflib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core import SettingField, SettingsError, settings_of
from walltopo.core.settings import checked_value
from walltopo.core.toml import read_toml
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.describe.routes.settings import RoutesSettings
from walltopo.editing.settings import EditSettings
from walltopo.publish.settings import ExportSettings
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.reconstruct.ingest.settings import IngestSettings
from walltopo.reconstruct.scale.settings import ScaleSettings
from walltopo.reconstruct.sparse.settings import SparseSettings
from walltopo.reconstruct.texture.settings import TextureSettings
from walltopo.segment.detect.settings import DetectSettings
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.propose.settings import ProposeSettings


@dataclass(frozen=True)
class Settings:
    """One section per stage; each field's help, unit and range stand at its declaration."""

    ingest: IngestSettings = field(default_factory=IngestSettings)
    sparse: SparseSettings = field(default_factory=SparseSettings)
    scale: ScaleSettings = field(default_factory=ScaleSettings)
    dense: DenseSettings = field(default_factory=DenseSettings)
    texture: TextureSettings = field(default_factory=TextureSettings)
    detect: DetectSettings = field(default_factory=DetectSettings)
    # The library's defaults suit masks whose errors go both ways; the shipped detector's masks are
    # rather too small and miss volumes in many photos. Chosen on generated gyms (docs/lift.md).
    lift: LiftParams = field(default_factory=lambda: LiftParams(threshold=0.4, least_support=0.05))
    propose: ProposeSettings = field(default_factory=ProposeSettings)
    classify: ClassifySettings = field(default_factory=ClassifySettings)
    routes: RoutesSettings = field(default_factory=RoutesSettings)
    edit: EditSettings = field(default_factory=EditSettings)
    export: ExportSettings = field(default_factory=ExportSettings)

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """Plain values by section and key (JSON-able)."""
        plain = msgspec.to_builtins(self)
        return {section: plain[section] for section in SECTIONS}


SECTIONS = tuple(f.name for f in dataclasses.fields(Settings))


def sections() -> Mapping[str, Mapping[str, SettingField]]:
    """Every declared setting, by section and name; with the defaults of a scan."""
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
    """Defaults, then the TOML file, then `section.key=value` overrides.

    Parameters
    ----------
    programs : whether the file may say which program is run; not one that merely lay in the
        working folder, which may have come with somebody's photos.

    Raises
    ------
    SettingsError : an unknown key (the nearest known one is named), a value of the wrong type or
        out of range, a program named by a file that may not.
    InputError : the file does not exist, or is not TOML.

    Examples
    --------
    >>> load_settings(None, ["texture.size=2048"]).texture.size
    2048
    """
    values: dict[str, dict[str, Any]] = {}
    if file is not None:
        for key, value in _entries(file):
            _put(values, key, value, str(file))
            if not programs:
                _refuse_program(key, value, file)
    for text in overrides:
        key, equals, raw = text.partition("=")
        if not equals:
            raise SettingsError(f"--set {text}: expected section.key=value")
        _put(values, key.strip(), _parse(raw.strip()), "--set")
    sections = {}
    for f in dataclasses.fields(Settings):
        default = getattr(Settings(), f.name)
        sections[f.name] = dataclasses.replace(default, **values.get(f.name, {}))
    return Settings(**sections)


def allowed(field: SettingField) -> str:
    """What a setting may be, for people; empty where its type says all."""
    if field.choices:
        return ", ".join(field.choices)
    ends = ("" if end is None else str(end) for end in (field.low, field.high))
    return "" if field.low is None and field.high is None else " .. ".join(ends).strip()


def settings_markdown() -> str:
    """`docs/settings.md`: a table per section; settings for experts in a second one."""
    lines = [
        "# Settings",
        "",
        "Written by `make docs`. Give them in `walltopo.toml` (read from the working folder, or",
        "named by `--config`) or as `--set section.key=value`. An unknown key is an error.",
        "",
        "A `walltopo.toml` that is merely found in the working folder may have come with somebody",
        f"else's photos: it may not set {_programs()},",
        "which lead to programs that are run. `--config FILE` and `--set` may: who types a path",
        "means it.",
        "",
        "The first table of a section is what most gyms will ever touch; the second, where there",
        "is one, is for those who measure methods (`walltopo settings --all` shows it).",
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
    """The settings that lead to a program, for people."""
    keys = [
        f"`{s}.{n}`" for s, fields in sections().items() for n, f in fields.items() if f.program
    ]
    return ", ".join(keys[:-1]) + f" and {keys[-1]}"


def _entries(file: Path) -> Iterator[tuple[str, Any]]:
    hint = "`walltopo settings` writes one to start from."
    for section, content in read_toml(file, hint).items():
        if not isinstance(content, dict):
            raise SettingsError(f"{file}: {section} stands outside a section such as [lift]")
        for key, value in content.items():
            yield f"{section}.{key}", value


def _refuse_program(key: str, value: object, file: Path) -> None:
    section, _, name = key.partition(".")
    if sections()[section][name].program and value:
        raise SettingsError(
            f"{file}: {key} leads to a program that would be run, which a file found in the "
            "working folder may not name",
            f"If you trust it, say --config {file}, or --set {key}=...",
        )


def _put(values: dict[str, dict[str, Any]], key: str, value: object, origin: str) -> None:
    section, _, name = key.partition(".")
    known = {f"{s}.{n}": field for s, fields in sections().items() for n, field in fields.items()}
    if key not in known:
        near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
        meant = f"Did you mean {near[0]}?" if near else ""
        raise SettingsError(
            f"{origin}: unknown setting {key!r}",
            f"{meant} `walltopo settings` lists all.".strip(),
        )
    values.setdefault(section, {})[name] = checked_value(value, known[key], f"{origin}: {key}")


def _parse(raw: str) -> Any:
    """The TOML value of a command-line word; what is not TOML is a plain string."""
    try:
        return tomllib.loads(f"v = {raw}")["v"]
    except (ValueError, RecursionError):  # not TOML, or thousands of digits or brackets
        return raw
