"""A wheel that carries its kernels compiled: the first scan then waits for no compiler.

    python -m tools.compiled_wheel dist/walltopo-0.2.0-py3-none-any.whl

Writes a wheel for this Python on 64-bit x86 Linux beside the given one, with numba's cache
files for all kernels of `walltopo/pipeline/kernels.txt`. They are used where numba has the version
that is installed here and the processor is of the kind
`walltopo.geometry.kernels.PROCESSOR` or newer;
elsewhere the scan compiles, as with the pure wheel.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from numba import config

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.geometry.kernels import PROCESSOR

# The object code links numba's own runtime and needs no newer C library than Python itself.
_PLATFORM = "manylinux_2_17_x86_64"
# Python code that compiles all kernels of the walltopo that it imports, and prints the table's
# path. It runs in a process of its own, with the package of an unpacked wheel or another tree.
COMPILE_KERNELS = """
from walltopo.pipeline.warm_up import TABLE, compile_line
for line in TABLE.read_text(encoding="utf-8").splitlines():
    compile_line(line)
print(TABLE)
"""


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("wheel", type=Path, help="of walltopo, pure Python")
    print(compiled_wheel(parser.parse_args().wheel))  # noqa: T201
    return 0


def compiled_wheel(pure: Path) -> Path:
    """Write the wheel with compiled kernels beside `pure` and return its path.

    Parameters
    ----------
    pure : `walltopo-VERSION-py3-none-any.whl`; is not changed.

    Raises
    ------
    InputError : the file is not such a wheel.
    EnvironmentLacksError : no 64-bit Linux on x86, an older processor, or a kernel does not
        compile here.
    """
    if not pure.is_file() or not pure.name.endswith("-py3-none-any.whl"):
        raise InputError(f"{pure}: not a wheel of pure Python", "make wheels")
    if sys.platform != "linux" or config.CPU_NAME != PROCESSOR:
        raise EnvironmentLacksError(f"kernels are compiled on Linux, on an {PROCESSOR} processor")
    with tempfile.TemporaryDirectory() as temporary:
        room = Path(temporary)
        _wheel("unpack", str(pure.absolute()), "-d", temporary)
        (inside,) = room.iterdir()
        _compile(inside)
        _wheel("pack", str(inside), "-d", temporary)
        (packed,) = room.glob("*.whl")
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        tags = "--python-tag", python, "--abi-tag", python, "--platform-tag", _PLATFORM
        _wheel("tags", "--remove", *tags, str(packed))
        (done,) = room.glob("*.whl")
        target = pure.with_name(done.name)
        target.write_bytes(done.read_bytes())
    return target


def _wheel(*arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "wheel", *arguments], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise EnvironmentLacksError(f"wheel {arguments[0]}: {done.stderr.strip()}")


def _compile(inside: Path) -> None:
    """Compile the kernels, so that numba writes its cache files beside the modules of the wheel."""
    kept = {name: text for name, text in os.environ.items() if not name.startswith("NUMBA_")}
    environment = {**kept, "PYTHONPATH": str(inside), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", COMPILE_KERNELS],
        cwd=inside,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode or not Path(done.stdout.strip()).is_relative_to(inside):
        raise EnvironmentLacksError(
            f"the kernels were not compiled: {done.stderr.strip() or done.stdout.strip()}"
        )


if __name__ == "__main__":
    raise SystemExit(main())
