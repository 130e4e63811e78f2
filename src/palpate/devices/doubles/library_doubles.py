"""Doubles of the vendors' libraries: C sources that come with palpate, compiled where they are needed.

A double has a library's functions, numbers and faults, and a simulated hand behind them. The driver loads it as it
loads the vendor's, so that a user can try it, and a test can break it, without hardware. The sources lie beside this
file; each says in its head which functions switch its faults.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from palpate.errors import ResourceError, UsageError

__all__ = ["DOUBLES", "c_compiler", "compile_double"]

# device, as in --device: the source, and the library's name without what each system puts around it
DOUBLES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {"forcedimension": ("force_dimension_double.c", "drd"), "openhaptics": ("openhaptics_double.c", "HD")}
)
_COMPILERS = ("cc", "gcc", "clang")
_LIMIT = 120.0  # s for the compiler


def c_compiler() -> str:
    """Return the path of the system's C compiler: that of the variable ``CC``, else cc, gcc or clang."""
    for name in (os.environ.get("CC", ""), *_COMPILERS):
        if name and (path := shutil.which(name)):
            return path
    raise ResourceError(
        "There is no C compiler on this machine.",
        why=f"Looked for the program in the variable CC, and for {', '.join(_COMPILERS)}.",
        fix="Install one: on Debian and Ubuntu `apt install gcc libc6-dev`, on macOS `xcode-select --install`.",
    )


def compile_double(device: str, folder: Path, definitions: Mapping[str, float] | None = None) -> Path:
    """Compile the double of a device's library into a folder, made if it doesn't exist, and return its file.

    The device is a driver's name as in ``--device``; `definitions` are numbers that the source takes at compile time,
    such as the stroke of its hand. A ResourceError says that there is no compiler, or that it failed.
    """
    if device not in DOUBLES:
        raise UsageError(
            f"There is no library to compile as a double of {device!r}.",
            fix=f"Choose one of {', '.join(DOUBLES)}.",
        )
    source, stem = DOUBLES[device]
    name = {"win32": f"{stem}.dll", "darwin": f"lib{stem}.dylib"}.get(sys.platform, f"lib{stem}.so")
    folder.mkdir(parents=True, exist_ok=True)
    library = folder.resolve() / name
    numbers = [f"-D{key}={value!r}" for key, value in (definitions or {}).items()]
    command = [
        *(c_compiler(), "-O2", "-std=gnu11", "-Wall", "-Wextra", "-shared", "-fPIC", *numbers),
        *(str(Path(__file__).parent / source), "-o", str(library), "-lm", "-lpthread"),
    ]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
        failed = f"It ended with {done.returncode}: {done.stderr.strip()[-500:]}" if done.returncode else ""
    except subprocess.TimeoutExpired:
        failed = f"The compiler was not ready after {_LIMIT:g} s."
    if failed:
        raise ResourceError(
            f"The double of {device} could not be compiled.",
            why=failed,
            fix="Run the command by hand, or name another compiler in the variable CC: " + " ".join(command),
        )
    return library
