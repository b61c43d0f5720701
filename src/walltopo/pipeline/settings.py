"""All settings of a scan in one typed object, from defaults, `walltopo.toml` and `--set`."""

from __future__ import annotations

import dataclasses
import difflib
import tomllib
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from walltopo.core import InputError, SettingsError
from walltopo.dense.contract import DenseSettings
from walltopo.detect.contract import DetectSettings
from walltopo.export.contract import ExportSettings
from walltopo.holds.contract import ClassifySettings
from walltopo.lifting.contract import LiftParams
from walltopo.measure.contract import ScaleSettings
from walltopo.photos.contract import IngestSettings
from walltopo.routes.contract import RoutesSettings
from walltopo.sparse.contract import SparseSettings
from walltopo.texture.contract import TextureSettings

__all__ = ["Settings", "SettingDoc", "describe_settings", "load_settings", "settings_markdown"]


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
    classify: ClassifySettings = field(default_factory=ClassifySettings)
    routes: RoutesSettings = field(default_factory=RoutesSettings)
    export: ExportSettings = field(default_factory=ExportSettings)

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """Plain values by section and key (JSON-able)."""
        return {section: _plain(dataclasses.asdict(getattr(self, section))) for section in SECTIONS}


SECTIONS = tuple(f.name for f in dataclasses.fields(Settings))


@dataclass(frozen=True)
class SettingDoc:
    """What one setting is, for help texts and docs."""

    key: str
    type: str
    default: Any
    help: str
    unit: str
    allowed: str


def load_settings(file: Path | None = None, overrides: Sequence[str] = ()) -> Settings:
    """Defaults, then the TOML file, then `section.key=value` overrides.

    Raises
    ------
    SettingsError : an unknown key (the nearest known one is named), a value of the wrong type or
        out of range, TOML that cannot be read.
    InputError : the file does not exist.
    """
    values: dict[str, dict[str, Any]] = {}
    if file is not None:
        for key, value in _read_toml(file):
            _put(values, key, value, str(file))
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


def describe_settings() -> list[SettingDoc]:
    """Every setting in the order of the stages."""
    docs: list[SettingDoc] = []
    defaults = Settings()
    for section in SECTIONS:
        value = getattr(defaults, section)
        hints = typing.get_type_hints(type(value))
        for f in dataclasses.fields(value):
            meta: Mapping[str, Any] = f.metadata
            low, high = meta.get("low"), meta.get("high")
            allowed = ", ".join(meta.get("choices", ()))
            if low is not None or high is not None:
                allowed = f"{'' if low is None else low} .. {'' if high is None else high}".strip()
            docs.append(
                SettingDoc(
                    f"{section}.{f.name}",
                    _type_name(hints[f.name]),
                    getattr(value, f.name),
                    meta.get("help", ""),
                    meta.get("unit", ""),
                    allowed,
                )
            )
    return docs


def settings_markdown() -> str:
    """`docs/settings.md`: one table per section."""
    lines = [
        "# Settings",
        "",
        "Written by `make docs`. Give them in `walltopo.toml` (read from the working folder, or",
        "named by `--config`) or as `--set section.key=value`. An unknown key is an error.",
    ]
    section = ""
    for doc in describe_settings():
        head, _, name = doc.key.partition(".")
        if head != section:
            lines += ["", f"## {head}", "", "| key | default | what | unit | allowed |"]
            lines += ["|---|---|---|---|---|"]
            section = head
        text = doc.help.replace("|", "\\|")
        lines.append(f"| `{name}` | `{doc.default}` | {text} | {doc.unit} | {doc.allowed} |")
    return "\n".join(lines) + "\n"


def _read_toml(file: Path) -> Iterator[tuple[str, Any]]:
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{file}: no such settings file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsError(f"{file}: not valid TOML ({error})") from error
    for section, content in data.items():
        if not isinstance(content, dict):
            raise SettingsError(f"{file}: {section} stands outside a section such as [lift]")
        for key, value in content.items():
            yield f"{section}.{key}", value


def _put(values: dict[str, dict[str, Any]], key: str, value: Any, origin: str) -> None:
    section, _, name = key.partition(".")
    known = dict(_hints())
    if key not in known:
        near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
        meant = f"Did you mean {near[0]}?" if near else ""
        raise SettingsError(
            f"{origin}: unknown setting {key!r}",
            f"{meant} `walltopo settings` lists all.".strip(),
        )
    values.setdefault(section, {})[name] = _coerce(value, known[key], key, origin)


def _hints() -> Iterator[tuple[str, Any]]:
    for f in dataclasses.fields(Settings):
        section_type = type(getattr(Settings(), f.name))
        for name, hint in typing.get_type_hints(section_type).items():
            yield f"{f.name}.{name}", hint


def _parse(raw: str) -> Any:
    """The TOML value of a command-line word; what is not TOML is a plain string."""
    try:
        return tomllib.loads(f"v = {raw}")["v"]
    except tomllib.TOMLDecodeError:
        return raw


def _coerce(value: Any, hint: Any, key: str, origin: str) -> Any:
    """Check a TOML value against the field's type; ints pass as floats, lists as tuples."""
    origin_type = typing.get_origin(hint)
    arguments = typing.get_args(hint)
    if origin_type in (typing.Union, types.UnionType):
        if value == "none" and type(None) in arguments:
            return None
        for option in arguments:
            if option is not type(None):
                return _coerce(value, option, key, origin)
    if origin_type is tuple and isinstance(value, list):
        inner = arguments[0] if arguments else Any
        return tuple(_coerce(item, inner, key, origin) for item in value)
    if hint is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    if hint is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if hint is bool and isinstance(value, bool):
        return value
    if hint is str:
        return value if isinstance(value, str) else str(value)
    if hint is Path and isinstance(value, str):
        return Path(value)
    raise SettingsError(f"{origin}: {key}: expected {_type_name(hint)}, got {value!r}")


def _type_name(hint: Any) -> str:
    return hint.__name__ if isinstance(hint, type) else str(hint).replace("typing.", "")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, Path) else value
