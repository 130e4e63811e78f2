"""The generic binaries of FMUs: one for each platform, built of the evaluator core and kept with the package.

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

from palpate.errors import ResourceError
from palpate.export.core_source import generic_source

__all__ = ["build_binaries", "built_binaries", "fmu_source", "main"]

_LINUX, _MAC = ("-target", "x86_64-linux-gnu.2.17"), "darwin64/.dylib"
TARGETS: Mapping[str, tuple[str, ...]] = {
    "linux64/.so": _LINUX,
    "win64/.dll": ("-target", "x86_64-windows-gnu"),
}
MAC_TARGETS = {"x86_64": ("-target", "x86_64-macos.11.0"), "aarch64": ("-target", "aarch64-macos.11.0")}
_MAC_KINDS = {"x86_64": (0x01000007, 3), "aarch64": (0x0100000C, 0)}  # of <mach/machine.h>
_OPTIONS = (
    "-std=c99",
    "-O2",
    "-g0",
    "-s",
    "-shared",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
)
_PAGE = 14  # bits: the parts of a universal file begin at pages of 16 KiB
_HASHES = "hashes.json"
_LONGEST = 600.0  # s


def fmu_source() -> str:
    """Return the whole source of the generic binary as one text."""
    return generic_source("fmi2.c")


def built_binaries() -> dict[str, bytes]:
    """Return the binaries that are kept with the package, by folder and ending: "linux64/.so"."""
    folder = resources.files("palpate.export") / "binaries"
    found = {}
    for file in (*TARGETS, _MAC):
        kept = folder / _file_of(file)
        if kept.is_file():
            found[file] = kept.read_bytes()
    return found


def _file_of(target: str) -> str:
    return target.replace("/", "_palpate_fmu")


def build_binaries() -> dict[str, bytes]:
    """Return the binaries, compiled anew.

    Raises
    ------
    ResourceError
        If there is no `ziglang`, or it refuses the source.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "palpate_fmu.c").write_text(fmu_source(), "utf-8")
        built = {file: _compile(folder, options) for file, options in TARGETS.items()}
        built[_MAC] = _universal({kind: _compile(folder, options) for kind, options in MAC_TARGETS.items()})
    return built


def _compile(folder: Path, options: tuple[str, ...]) -> bytes:
    # in the folder, by relative names: no path of this machine gets into the binary
    command = [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        *options,
        *_OPTIONS,
        "palpate_fmu.c",
        "-o",
        "palpate_fmu.out",
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
    return (folder / "palpate_fmu.out").read_bytes()


def _cache() -> Path:
    return Path(tempfile.gettempdir()) / "palpate-zig-cache"


def _universal(parts: Mapping[str, bytes]) -> bytes:
    """Return one file for both kinds of Mac: a head in big-endian order, then each part at a page of its own."""
    head, offset = struct.pack(">II", 0xCAFEBABE, len(parts)), 1 << _PAGE
    body = b""
    for kind, content in parts.items():
        body += bytes(-len(body) % (1 << _PAGE))
        head += struct.pack(">5I", *_MAC_KINDS[kind], offset + len(body), len(content), _PAGE)
        body += content
    return head + bytes(offset - len(head)) + body


def main(arguments: list[str] | None = None) -> int:
    """Build the binaries and write them, or with --check compare them with those that are there; an exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    built = build_binaries()
    folder = Path(str(resources.files("palpate.export"))) / "binaries"
    hashes = {_file_of(file): hashlib.sha256(content).hexdigest() for file, content in built.items()}
    if "--check" in arguments:
        kept = json.loads((folder / _HASHES).read_text("utf-8"))
        other = [file for file, digest in hashes.items() if kept.get(file) != digest]
        print(f"other than those that are kept: {other}" if other else "the same as those that are kept")  # noqa: T201
        return 1 if other else 0
    folder.mkdir(exist_ok=True)
    for file, content in built.items():
        (folder / _file_of(file)).write_bytes(content)
        print(f"{_file_of(file)}  {len(content) / 1e3:.0f} kB")  # noqa: T201
    (folder / _HASHES).write_text(json.dumps(hashes, indent=2) + "\n", "utf-8")
    return 0
