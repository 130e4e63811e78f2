"""Export as a package of Unity: a component, the mesh at rest, the weights, and a library for three systems.

Nothing is compiled: the library was built beforehand and reads any body's weights (`engine_libraries`). Each file
goes out with Unity's `.meta` file beside it, so that references to it hold when the package is exported again.
"""

from __future__ import annotations

import hashlib
import json
import os
import struct
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

import numpy as np

from palpate.export.c_export import block_of
from palpate.export.c_files import require_name
from palpate.export.check_engine import CheckEngine, engine_library
from palpate.export.check_points import Comparison, compare_body
from palpate.export.core_source import fill_template
from palpate.export.engine_scene import press_ends, probe_radius, require_touch, shown_mesh, tool_words
from palpate.export.fmu_binaries import engine_libraries, require_generic
from palpate.export.package_folder import ExportedPackage, write_package
from palpate.export.weights_block import WeightsBlock, identifier
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.surrogates.model_card import NOT_STATED, card_of

__all__ = ["export_unity"]

_PLUGINS = {
    ".so": ("Linux64", "Linux", "x86_64"),
    ".dll": ("Win64", "Windows", "x86_64"),
    ".dylib": ("OSXUniversal", "OSX", "AnyCPU"),
}
_IMPORTERS = {
    ".cs": "MonoImporter",
    ".asmdef": "AssemblyDefinitionImporter",
    ".bytes": "TextScriptImporter",
    ".md": "TextScriptImporter",
}


def export_unity(
    surrogate: Surrogate,
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    check: bool = True,
    overwrite: bool = False,
) -> ExportedPackage:
    """Write a learnt body as a package of Unity, and compare its library with palpate at 1,000 places.

    Parameters
    ----------
    surrogate : Surrogate
        A body that a hand feels; with a displacement of its surface the package draws it.
    out : path
        Folder of the package, made in one that exists.
    name : str, optional
        Name of the package and of its namespace; by default the body's name.
    check : bool
        Whether the library is compared with palpate; that of another processor can't be.
    overwrite : bool
        True replaces files of an earlier export that somebody changed.

    Raises
    ------
    UsageError
        If the name is no identifier, the body has a part that the library does not hold, or a file in the folder is
        somebody else's.
    AccuracyError
        If the library differs from palpate by more than it may; nothing is written.
    """
    name = require_name(identifier(surrogate.name) if name is None else name)
    block, comparison = _checked_block(surrogate, check=check)
    files = _package_files(surrogate, name, block)
    files |= {f"{path}.meta": _meta(name, path) for path in _with_folders(files)}
    return ExportedPackage(Path(out), write_package(out, files, overwrite=overwrite), block.hash, comparison)


def _checked_block(surrogate: Surrogate, *, check: bool) -> tuple[WeightsBlock, Comparison | None]:
    """Return a body's weights for an engine, and how far the generic library is from palpate with them."""
    require_touch(surrogate)
    mesh = shown_mesh(surrogate)
    block = block_of(
        surrogate, field=None if mesh is None else mesh.name, with_field=mesh is not None, deviation=False
    )
    require_generic(surrogate, block, "library of engines")
    library = engine_library() if check else None
    if library is None:
        return block, None
    with CheckEngine(library, block.to_bytes()) as asked:
        comparison = compare_body(surrogate, asked, field=block.field, deviation=False)
    comparison.require(
        "The library does",
        why="Its binary or this machine may bend the arithmetic.",
        fix="Nothing was written. Report this.",
    )
    return block, comparison


def _vector(place: np.ndarray) -> str:
    return ", ".join(f"{v:.6g}f" for v in np.asarray(place)[[0, 2, 1]])


def _package_files(surrogate: Surrogate, name: str, block: WeightsBlock) -> dict[str, bytes]:
    """Return the files of the package by their relative names, without their meta files."""
    away, deep = press_ends(surrogate)
    space = name[0].upper() + name[1:]
    words = {
        "@TITLE@": surrogate.name,
        "@RADIUS@": f"{probe_radius(surrogate):.9g}",
        "@HOLDS@": "true" if surrogate.hand_energy.baseline.holds else "false",
        "@TORQUE@": "true" if block.torque else "false",
        "@AWAY@": _vector(away),
        "@DEEP@": _vector(deep),
        "@TOOL@": tool_words(surrogate),
        "CLASS": space,
        "NAME": name,
    }
    texts = {
        "README.md": "unity_readme.md",
        "Runtime/LearntBody.cs": "unity_learnt_body.cs",
        "Runtime/SoftBody.cs": "unity_soft_body.cs",
        "Samples~/Press/PressSample.cs": "unity_sample.cs",
    }
    files = {path: fill_template(template, words, ()).encode() for path, template in texts.items()}
    files["card.md"] = card_of(surrogate).with_hash(block.label, block.hash).to_markdown().encode()
    files["package.json"] = _json(_manifest(surrogate, name, space))
    files[f"Runtime/Palpate.{space}.asmdef"] = _json({"name": f"Palpate.{space}", "autoReferenced": True})
    files["Samples~/Press/Press.asmdef"] = _json(
        {"name": f"Palpate.{space}.Press", "references": [f"Palpate.{space}"]}
    )
    files[f"Runtime/Resources/palpate-{name}-weights.bytes"] = block.to_bytes()
    if (mesh := shown_mesh(surrogate)) is not None:
        files[f"Runtime/Resources/palpate-{name}-mesh.bytes"] = _mesh_bytes(mesh)
    for ending, content in engine_libraries().items():
        files[f"Runtime/Plugins/{'' if ending == '.dll' else 'lib'}palpate_{name}{ending}"] = content
    return files


def _json(value: Mapping[str, object]) -> bytes:
    return (json.dumps(value, indent=2) + "\n").encode()


def _manifest(surrogate: Surrogate, name: str, space: str) -> dict[str, object]:
    from palpate.version import __version__

    licence = card_of(surrogate).licence
    package = "".join(c for c in name.lower() if c.isalnum() or c == "-")
    return {
        "name": f"org.palpate.{package}",
        "version": __version__,
        "displayName": f"palpate: {surrogate.name}",
        "description": "A body learnt from finite-element solves, with force and deformed shape. Tried with Mono and "
        "stand-ins for Unity's types, not in the Unity editor.",
        "unity": "2021.3",
        **({} if licence == NOT_STATED else {"license": licence}),  # of the body; the library's own is MIT
        "samples": [
            {
                "displayName": "Press",
                "description": f"A ball presses {space}.",
                "path": "Samples~/Press",
            }
        ],
    }


def _mesh_bytes(mesh: FieldSurrogate) -> bytes:
    """Return points and triangles as LearntBody.cs reads them: counts, places and corners in Unity's frame."""
    places = np.asarray(mesh.points)[:, [0, 2, 1]].astype("<f4")
    corners = np.asarray(mesh.triangles)[:, [0, 2, 1]].astype("<i4")  # as the frame is mirrored
    return struct.pack("<2i", len(places), len(corners)) + places.tobytes() + corners.tobytes()


def _with_folders(files: Mapping[str, bytes]) -> list[str]:
    """Return the names of files and folders that Unity gives meta files: all but those of folders that end in ~."""
    names = set(files) | {str(parent) for path in files for parent in PurePosixPath(path).parents}
    return sorted(name for name in names if name != "." and "~" not in name)


def _meta(package: str, path: str) -> bytes:
    """Return the meta file of a file or folder: its identity, which depends on its name alone, and its importer."""
    ending = Path(path).suffix
    identity = hashlib.sha256(f"palpate/{package}/{path}".encode()).hexdigest()[:32]
    head = f"fileFormatVersion: 2\nguid: {identity}\n"
    if ending in _PLUGINS:
        return (head + _plugin_importer(*_PLUGINS[ending])).encode()
    kind = "PackageManifestImporter" if path == "package.json" else _IMPORTERS.get(ending, "DefaultImporter")
    folder = "" if ending else "folderAsset: yes\n"
    version = "  serializedVersion: 2\n  defaultReferences: []\n" if kind == "MonoImporter" else ""
    return f"{head}{folder}{kind}:\n  externalObjects: {{}}\n{version}  userData: \n".encode()


def _plugin_importer(platform: str, system: str, processor: str) -> str:
    """Return the settings by which Unity loads a library on its own system alone, in the editor and in players."""
    excluded = "".join(
        f"        Exclude {p}: {int(p != platform)}\n" for p in ("Linux64", "OSXUniversal", "Win64")
    )
    parts = [("Editor", "Editor", f"        CPU: {processor}\n        OS: {system}\n")]
    parts.append(("Standalone", platform, f"        CPU: {processor}\n"))
    enabled = "".join(
        f"  - first:\n      {kind}: {target}\n    second:\n      enabled: 1\n      settings:\n{settings}"
        for kind, target, settings in parts
    )
    return (
        "PluginImporter:\n  externalObjects: {}\n  serializedVersion: 2\n  isPreloaded: 0\n  isOverridable: 0\n"
        "  isExplicitlyReferenced: 0\n  validateReferences: 1\n  platformData:\n"
        "  - first:\n      : Any\n    second:\n      enabled: 0\n      settings:\n        Exclude Editor: 0\n"
        f"{excluded}"
        f"{enabled}  userData: \n"
    )
