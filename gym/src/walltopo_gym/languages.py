"""The platform's languages, the same as those of the app (`gym/web/src/i18n.svelte.ts`)."""

from __future__ import annotations

from typing import Final, Literal

Language = Literal["en", "de", "cs", "fr"]
LANGUAGES: Final[tuple[Language, ...]] = ("en", "de", "cs", "fr")
