"""The C compilers of this machine, and how a program is compiled with them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from palpate.errors import ResourceError, UsageError

__all__ = ["COMPILERS", "STRICT", "compile_c", "find_compiler"]

COMPILERS = ("cc", "gcc", "clang", "tcc")
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror")
_LONGEST = 300.0  # s that a compiler may take


def find_compiler(name: str | None = None) -> str | None:
    """Return the path of a C compiler: that of a name, of the variable CC, or the first one known; None without any.

    A name without a compiler is an error.
    """
    if name and shutil.which(name) is None:
        raise UsageError(
            f"There is no compiler {name!r}.",
            why="No program of that name is found in the folders of PATH.",
            fix="Give another name or a path, or leave it out to take the first one of "
            f"{', '.join(COMPILERS)} that is found.",
        )
    for word in [name] if name else [os.environ.get("CC"), *COMPILERS]:
        if word and (path := shutil.which(word)):
            return path
    return None


def compile_c(
    compiler: str, sources: Sequence[Path], out: Path, *, options: Sequence[str] = (), optimise: str = "-O2"
) -> Path:
    """Compile sources within five minutes to a program or, with the option ``-shared``, to a library."""
    command = [compiler, "-std=c99", optimise, *options, *map(str, sources), "-o", str(out), "-lm"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ResourceError(f"{compiler} did not compile {sources[0].name}: {error}.") from error
    if done.returncode:
        raise ResourceError(
            f"{compiler} refused {sources[0].name}.",
            why=(done.stderr or done.stdout)[:2000],
            fix="Write the files without comparing them: --no-check.",
        )
    return out
