"""The record of a finished inspection on paper."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final
from zoneinfo import ZoneInfo

from walltopo_gym.inspections.levels import texts_in
from walltopo_gym.inspections.signing import code_of, key_name
from walltopo_gym.inspections.tables import latest_facts
from walltopo_gym.languages import Language
from walltopo_gym.paper.sheet import Paper, Sheet
from walltopo_gym.words import Words, words_in

_MAX_PHOTOS: Final = 60


def spaced_code(code: str) -> str:
    """Return a code in groups of four, as people read it."""
    return "-".join(code[at : at + 4] for at in range(0, len(code), 4))


@dataclass(frozen=True)
class RecordPaper:
    """A finished inspection to print.

    Parameters
    ----------
    file : as `record.record_file` returns it. zone : of the gym's times.
    photo : returns a photo by its name, None if it is gone. base : address of the server.
    corrected : record of the inspection that this one corrects, or None. size : of the pages.
    """

    file: dict[str, Any]
    zone: ZoneInfo
    photo: Callable[[str], bytes | None]
    base: str
    corrected: str | None
    size: Paper

    def pdf(self, language: Language) -> tuple[bytes, set[str]]:
        """Return the pages, and the characters that their font lacks."""
        texts, words = texts_in(language), words_in(language)
        record = self.file["record"]
        code = self.file["code"]
        title = texts["title"].format(level=texts[record["level"]])
        sheet = Sheet(
            title,
            f"{record['gym']['name']}, {self._moment(record['finished']['at'], words)}",
            foot=f"{record['gym']['name']} · {spaced_code(code)}",
            page=words.say("page", page="{page}", pages="{pages}"),
            code=f"{self.base}/verify/{code}",
            code_note=texts["verify"],
            size=self.size,
            lacks=words.say("lacks", scripts="{scripts}"),
        )
        self._add_facts(sheet, texts, words)
        latest = latest_facts(record["entries"])
        for wall in record["walls"]:
            here = [entry for entry in latest if entry["wall_id"] == wall["id"]]
            self._add_wall(sheet, wall["name"], here, texts, words)
        self._add_photos(sheet, latest, texts)
        if self.file["late"]:
            sheet.heading(texts["late"])
            self._add_late(sheet, texts, words)
        sheet.text(texts["limits"], quiet=True)
        signed = texts["signed"].format(
            key=key_name(self.file["public_key"]),
            name=record["finished"]["by"] or texts["nobody"],
            code=spaced_code(code),
        )
        sheet.text(signed, quiet=True)
        sheet.text(f"{self.base}/verify/{code}", quiet=True)
        return sheet.pdf(), sheet.missing

    def _add_facts(self, sheet: Sheet, texts: dict[str, str], words: Words) -> None:
        record = self.file["record"]

        def act(name: str) -> list[str]:
            of = record[name]
            at = self._moment(of["at"], words)
            return [texts[name], texts["by"].format(at=at, name=of["by"] or texts["nobody"])]

        rows = [
            [texts["result"], texts[record["result"]]],
            act("started"),
            act("finished"),
            [texts["walls"], ", ".join(wall["name"] for wall in record["walls"])],
        ]
        if record["remarks"]:
            rows.append([texts["remarks"], " ".join(record["remarks"].split())])
        if self.corrected is not None:
            finished = json.loads(self.corrected)["finished"]["at"]
            day = words.day(datetime.fromisoformat(finished).astimezone(self.zone).date())
            code = spaced_code(code_of(self.corrected))
            rows.append([texts["corrects"], texts["corrects_id"].format(code=code, day=day)])
        sheet.table([], rows, widths=[2, 7], bold={0})

    def _add_wall(
        self,
        sheet: Sheet,
        name: str,
        entries: list[dict[str, Any]],
        texts: dict[str, str],
        words: Words,
    ) -> None:
        items = {entry["item"]: entry for entry in entries if entry["item"] is not None}
        checklist = self.file["record"]["checklist"]
        sheet.heading(texts["checklist"].format(wall=name))
        heads = [texts["item"], texts["mark"], texts["note"], texts["who"]]
        rows = [self._item_row(text, items.get(n), texts) for n, text in enumerate(checklist)]
        sheet.table(heads, rows, widths=[5, 2, 3, 2], bold={1})
        holds = [entry for entry in entries if entry["hold"] is not None]
        if holds:
            sheet.heading(texts["holds"].format(wall=name))
            self._add_entries(sheet, sorted(holds, key=lambda one: one["hold"]), texts, words)
            sheet.text(texts["all"], quiet=True)

    def _item_row(
        self, text: str, entry: dict[str, Any] | None, texts: dict[str, str]
    ) -> list[str]:
        if entry is None:
            return [text, texts["unchecked"], "", ""]
        return [text, texts[entry["mark"]], entry["note"], entry["by"]]

    def _add_entries(
        self, sheet: Sheet, entries: list[dict[str, Any]], texts: dict[str, str], words: Words
    ) -> None:
        heads = [texts["hold"], texts["mark"], texts["note"], texts["who"]]
        rows = [self._entry_row(entry, texts, words) for entry in entries]
        sheet.table(heads, rows, widths=[2, 2, 4, 4], bold={1})

    def _add_late(self, sheet: Sheet, texts: dict[str, str], words: Words) -> None:
        walls = {wall["id"]: wall["name"] for wall in self.file["record"]["walls"]}
        heads = [texts[name] for name in ("wall", "hold", "mark", "note", "who")]
        rows = [
            [walls.get(entry["wall_id"], ""), *self._entry_row(entry, texts, words)]
            for entry in self.file["late"]
        ]
        sheet.table(heads, rows, widths=[2, 2, 2, 3, 3], bold={2})

    def _entry_row(self, entry: dict[str, Any], texts: dict[str, str], words: Words) -> list[str]:
        place = self._place(entry, texts)
        return [place, texts[entry["mark"]], entry["note"], self._by(entry, words)]

    def _place(self, entry: dict[str, Any], texts: dict[str, str]) -> str:
        """Return the hold of an entry, or its item of the checklist."""
        if entry["hold"] is not None:
            return texts["hold_number"].format(number=entry["hold"])
        return str(self.file["record"]["checklist"][entry["item"]])

    def _add_photos(
        self, sheet: Sheet, entries: list[dict[str, Any]], texts: dict[str, str]
    ) -> None:
        named = [entry for entry in entries if entry["photo"]]
        shown = []
        for entry in named[:_MAX_PHOTOS]:
            content = self.photo(entry["photo"])
            if content is not None:
                shown.append((content, f"{self._place(entry, texts)}: {texts[entry['mark']]}"))
        if shown:
            sheet.heading(texts["photos"], below=60)
            sheet.pictures(shown)
        if len(named) > _MAX_PHOTOS:
            sheet.text(texts["more_photos"].format(number=len(named) - _MAX_PHOTOS), quiet=True)

    def _by(self, entry: dict[str, Any], words: Words) -> str:
        return ", ".join(filter(None, (entry["by"], self._moment(entry["at"], words))))

    def _moment(self, text: str, words: Words) -> str:
        at = datetime.fromisoformat(text).astimezone(self.zone)
        return f"{words.day(at.date())}, {at:%H:%M}"
