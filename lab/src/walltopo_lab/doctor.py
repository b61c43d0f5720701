"""The part of `walltopo doctor` about this distribution: which of its extras are installed."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

from walltopo.cli.diagnosis import Finding
from walltopo_lab.extras import EXTRAS


def examine() -> Iterator[Finding]:
    """Yield a finding for the distribution and one for each extra."""
    yield Finding("walltopo-lab", "ok", "installed")
    for extra, names in EXTRAS.items():
        absent = [name for name in names if importlib.util.find_spec(name) is None]
        state, detail = ("missing", f"lacks {', '.join(absent)}") if absent else ("ok", "installed")
        mend = f"pip install 'walltopo-lab[{extra}]'" if absent else ""
        yield Finding(f"lab, extra {extra}", state, detail, mend)
