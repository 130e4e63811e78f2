"""The generic binaries, kept with the package: those of FMUs, and the library of a scene's engine.

One of each for every platform reads any body's weights; those of FMUs serve both versions of FMI.

    .ci/build_fmu_binaries [--check]

builds them with the C compiler of the `ziglang` wheel, which compiles for all platforms on each of them, and writes
their SHA-256 beside them; with --check they must be those that are there, to the last byte.
"""

from __future__ import annotations

import hashlib
import json
import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

from palpate.errors import ResourceError, UsageError
from palpate.export.core_source import generic_source
from palpate.export.weights_block import HEAD, WeightsBlock
from palpate.surrogates import Surrogate

__all__ = ["build_binaries", "built_binaries", "engine_libraries", "fmu_source", "main", "require_generic"]

_SOURCES = (
    "memory_states.c",
    "answers.c",
    "answers_block.c",
    "fmi_instance.c",
    "fmi_motion.c",
    "fmi_body.c",
    "fmi_derivatives.c",
    "fmi_types.c",
    "fmi_calls.c",
    "fmi2.c",
    "fmi3.c",
)
_PROGRAMS = {"palpate_fmu": _SOURCES, "palpate_engine": ("field.c", "engine.c")}
# small code for macOS: both machines' parts, less than 200 kB each, stand in one file of FMI 2.0
# little is inlined there, and nothing unwinds; the head has room for a signature, and not a page of it
# for Windows, less is inlined than LLVM's 225 allows: its library would be above 200 kB otherwise
_SMALL = (
    "-Os",
    "-mllvm",
    "-inline-threshold=5",
    "-fno-unwind-tables",
    "-fno-asynchronous-unwind-tables",
    "-Wl,-headerpad,0x100",
)
TARGETS: Mapping[str, tuple[str, ...]] = {
    "x86_64-linux/.so": ("-target", "x86_64-linux-gnu.2.17", "-O2"),
    "x86_64-windows/.dll": ("-target", "x86_64-windows-gnu", "-O2", "-mllvm", "-inline-threshold=150"),
    "x86_64-darwin/.dylib": ("-target", "x86_64-macos.11.0", *_SMALL),
    "aarch64-darwin/.dylib": ("-target", "aarch64-macos.11.0", *_SMALL),
}
"""What is built: folder in an FMU of FMI 3.0 and ending, and the compiler's options."""
_FOLDERS2 = {"linux64/.so": "x86_64-linux/.so", "win64/.dll": "x86_64-windows/.dll"}
_UNIVERSAL = "darwin64/.dylib"
# kind of processor of <mach/machine.h>, and the bits of its pages, at which its part of a universal file begins
_MAC_KINDS = {"x86_64-darwin/.dylib": (0x01000007, 3, 12), "aarch64-darwin/.dylib": (0x0100000C, 0, 14)}
_OPTIONS = (
    "-std=c99",
    "-g0",
    "-s",
    "-shared",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
)
_HASHES = "hashes.json"
_LONGEST = 600.0  # s that a build may take


def fmu_source() -> str:
    """Return the whole source of the generic binary as one text."""
    return generic_source(*_SOURCES)


def engine_libraries() -> dict[str, bytes]:
    """Return the libraries of a scene's engine by their endings: ".so" for Linux, ".dll", ".dylib" for both Macs."""
    folder = resources.files("palpate.export") / "binaries"
    kept = {file: (folder / _file_of(file, "palpate_engine")).read_bytes() for file in TARGETS}
    parts = {file: kept[file] for file in _MAC_KINDS}
    return {
        ".so": kept["x86_64-linux/.so"],
        ".dll": kept["x86_64-windows/.dll"],
        ".dylib": _universal(parts),
    }


def require_generic(surrogate: Surrogate, block: WeightsBlock, program: str) -> None:
    """Refuse a body whose baseline or memory is not compiled into the generic binaries."""
    _, _, baseline, memory = block.tables[HEAD].values[:4].tolist()
    own = surrogate.memory
    if baseline and (own is None or memory):
        return
    kind = f"baseline {surrogate.hand_energy.baseline.name!r}"
    if baseline and own is not None:
        kind = f"memory {own.name!r}"
    raise UsageError(
        f"The {kind} is not in the generic {program}.",
        why="That is built beforehand, of palpate's own baselines and memories.",
        fix="Take the body out as C99, which compiles the C source of your own.",
    )


def built_binaries(version: str = "3.0") -> dict[str, bytes]:
    """Return the binaries that are kept with the package, by an FMU's folder and ending: "x86_64-linux/.so".

    In version 2.0 of FMI the folders have other names, and one file serves both kinds of macOS.
    """
    folder = resources.files("palpate.export") / "binaries"
    kept = {file: folder / _file_of(file) for file in TARGETS}
    there = {file: path.read_bytes() for file, path in kept.items() if path.is_file()}
    if version == "3.0":
        return there
    binaries = {name: there[file] for name, file in _FOLDERS2.items() if file in there}
    parts = {file: there[file] for file in _MAC_KINDS if file in there}
    return binaries | ({_UNIVERSAL: _universal(parts)} if parts else {})


def _file_of(target: str, program: str = "palpate_fmu") -> str:
    return target.replace("/", f"_{program}")


def build_binaries() -> dict[str, bytes]:
    """Return all binaries by their files' names, compiled anew with `ziglang`."""
    built = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for program, sources in _PROGRAMS.items():
            (folder / f"{program}.c").write_text(generic_source(*sources), "utf-8")
            for target, options in TARGETS.items():
                built[_file_of(target, program)] = _compile(folder, program, options)
    return built


def _compile(folder: Path, program: str, options: tuple[str, ...]) -> bytes:
    # in the folder, by relative names: no path of this machine gets into the binary
    command = [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        *options,
        *_OPTIONS,
        f"{program}.c",
        "-o",
        f"{program}.out",
    ]
    command += [] if "windows" in options[1] else ["-lm"]
    environment = {
        **os.environ,
        "ZIG_GLOBAL_CACHE_DIR": str(_cache()),
        "ZIG_LOCAL_CACHE_DIR": str(folder / "cache"),
    }
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=_LONGEST, check=False
    )
    if done.returncode:
        raise ResourceError(
            f"The generic binary for {options[1]} was not built.",
            why=done.stderr[-2000:],
            fix="Install the compiler: pip install ziglang.",
        )
    return (folder / f"{program}.out").read_bytes()


def _cache() -> Path:
    return Path(tempfile.gettempdir()) / "palpate-zig-cache"


def _universal(parts: Mapping[str, bytes]) -> bytes:
    """Return one file for both kinds of Mac: a head in big-endian order, then each part at a page of its own."""
    head, body = struct.pack(">II", 0xCAFEBABE, len(parts)), b""
    offset = len(head) + 20 * len(parts)
    for file, content in parts.items():
        kind, variant, bits = _MAC_KINDS[file]
        body += bytes(-(offset + len(body)) % (1 << bits))
        head += struct.pack(">5I", kind, variant, offset + len(body), len(content), bits)
        body += content
    return head + body


def main(arguments: list[str] | None = None) -> int:
    """Build the binaries and write them, or with --check compare them with those that are there; an exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    built = build_binaries()
    folder = Path(str(resources.files("palpate.export"))) / "binaries"
    hashes = {file: hashlib.sha256(content).hexdigest() for file, content in built.items()}
    if "--check" in arguments:
        kept = json.loads((folder / _HASHES).read_text("utf-8"))
        other = [file for file, digest in hashes.items() if kept.get(file) != digest]
        print(f"other than those that are kept: {other}" if other else "the same as those that are kept")  # noqa: T201
        return 1 if other else 0
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*_palpate_*"):
        old.unlink()
    for file, content in built.items():
        (folder / file).write_bytes(content)
        print(f"{file}  {len(content) / 1e3:.0f} kB")  # noqa: T201
    (folder / _HASHES).write_text(json.dumps(hashes, indent=2) + "\n", "utf-8")
    return 0
