"""Serve a demo gym for work on the platform: the server starts again when Python changes, and the
app is replaced in the open page when its sources change.

    make dev

The demo gym is kept in `demo-gym`. Ctrl-C stops both.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Final

from watchfiles import PythonFilter, run_process

ROOT: Final = Path(__file__).resolve().parents[1]
_APP: Final = "http://localhost:5173"
_DATA: Final = "demo-gym"
_WATCHED: Final = ("gym/src", "climb/src", "src")


def main() -> int:
    """Make the demo gym, and run server and app until Ctrl-C."""
    walltopo = [sys.executable, "-m", "walltopo"]
    made = subprocess.run([*walltopo, "gym", "demo", "--data", _DATA, "--no-serve"], check=False)
    if made.returncode:
        return made.returncode
    npm = shutil.which("npm")
    if npm is None:
        sys.stderr.write("error: npm is missing\nInstall Node 20 or newer.\n")
        return 5
    app = subprocess.Popen([npm, "run", "dev", "--", "--strictPort"], cwd=ROOT / "gym" / "web")
    threading.Thread(target=_interrupt_after, args=(app,), daemon=True).start()
    # Links in mails and the check of requests' origins name the address that the browser has.
    os.environ["WALLTOPO_GYM_ADDRESS"] = _APP
    serve = " ".join([*walltopo, "gym", "serve", "--data", _DATA])
    sys.stdout.write(f"{_APP}/g/demo\n")
    try:
        run_process(*(ROOT / one for one in _WATCHED), target=serve, watch_filter=PythonFilter())
    finally:
        ended = app.poll()
        app.terminate()
        app.wait()
    if ended:
        sys.stderr.write(f"error: the app's own server ended with code {ended}\n")
    return ended or 0


def _interrupt_after(app: subprocess.Popen[bytes]) -> None:
    """Stop like Ctrl-C when the app's server has failed."""
    if app.wait() > 0:
        os.kill(os.getpid(), signal.SIGINT)


if __name__ == "__main__":
    raise SystemExit(main())
