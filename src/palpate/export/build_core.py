"""Build the evaluator core for machines that have no compiler: WebAssembly for pages.

    python -m palpate.export.build_core

The built files are under version control, with the SHA-256 of the sources that each was built from. zig cross-compiles
them all (`pip install ziglang`); the same version gives the same bytes.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from palpate.errors import ResourceError, UsageError
from palpate.export.core_source import generic_source

__all__ = ["TARGETS", "Target", "build", "built_core", "main", "source_hash"]

# no fused products and sums: the answers are those of palpate to the last places; plain C of 1999
FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wl,--strip-all")
PATIENCE = 600.0  # s; the first build of a target compiles its C library, too


@dataclass(frozen=True)
class Target:
    """A built form of the core."""

    file: str
    programs: tuple[str, ...]  # the last of the core's sources, which say what it gives to the outside
    options: tuple[str, ...]  # for the compiler


TARGETS = (
    Target(
        "core.wasm",
        ("field.c", "wasm.c"),
        (
            "-target",
            "wasm32-wasi",
            "-msimd128",  # in browsers since 2023 at the latest; an answer takes 5 instead of 8 µs
            "-mexec-model=reactor",
            "-Wl,--export=__heap_base",
        ),
    ),
)


def source_hash(target: Target) -> str:
    """Return the SHA-256 of all that a target is built from."""
    text = "\n".join([*FLAGS, *target.options, generic_source(*target.programs)])
    return hashlib.sha256(text.encode()).hexdigest()


def _folder() -> Any:
    return resources.files("palpate.export") / "built"


def built_core(file: str) -> bytes:
    """Return a built file of the package; an error where it is missing, or of other sources than this package's."""
    target = next(target for target in TARGETS if target.file == file)
    built, stamp = _folder() / file, _folder() / f"{file}.sources"
    if not built.is_file() or stamp.read_text("ascii").strip() != source_hash(target):
        raise ResourceError(
            f"The built evaluator core {file} is missing, or of other sources.",
            why="It is built from the C files of this package and stored beside them.",
            fix="Run: pip install ziglang; python -m palpate.export.build_core",
        )
    return bytes(built.read_bytes())


def build(target: Target, out: Path) -> None:
    """Compile a target into a file with zig."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "core.c"
        source.write_text(generic_source(*target.programs), encoding="utf-8", newline="\n")
        command = [sys.executable, "-m", "ziglang", "cc", *FLAGS, *target.options, "-o", str(out), "core.c"]
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    if done.returncode != 0:
        raise UsageError(
            f"The core can't be built as {target.file}.",
            why=done.stderr.strip()[-2000:],
            fix="Install the compiler: pip install ziglang",
        )


def main() -> None:
    """Build every target into the package."""
    folder = Path(str(_folder()))
    folder.mkdir(exist_ok=True)
    for target in TARGETS:
        build(target, folder / target.file)
        (folder / f"{target.file}.sources").write_text(f"{source_hash(target)}\n", encoding="ascii")
        print(f"{target.file}  {(folder / target.file).stat().st_size / 1e3:.0f} kB")  # noqa: T201


if __name__ == "__main__":
    main()
