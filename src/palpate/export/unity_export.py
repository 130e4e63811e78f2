"""Export as a package of Unity: a component, the mesh at rest, the weights, and a library for three systems.

Nothing is compiled: the library was built beforehand and reads any body's weights (`fmu_binaries.engine_libraries`). Each
file goes out with Unity's `.meta` file beside it, so that references to it hold when the package is exported again.
"""

from __future__ import annotations

import hashlib
import json
import os
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.errors import UsageError
from palpate.export.c_export import block_of
from palpate.export.c_files import require_name
from palpate.export.check_engine import CheckEngine, engine_library
from palpate.export.check_points import Comparison, compare_body
from palpate.export.core_source import fill_template
from palpate.export.fmu_binaries import engine_libraries
from palpate.export.package_folder import write_package
from palpate.export.weights_block import WeightsBlock, identifier
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.surrogates.model_card import card_of

__all__ = ["ExportedPackage", "checked_block", "export_unity", "press_ends", "shown_mesh"]

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


@dataclass(frozen=True)
class ExportedPackage:
    """A folder for an engine, and how far its library is from palpate.

    Attributes
    ----------
    folder : Path
        The package.
    files : tuple of Path
        All of its files.
    hash : str
        SHA-256 of the weights.
    comparison : Comparison, optional
        How far it is from palpate; None where nothing was to be compared, or nothing here runs it.
    """

    folder: Path
    files: tuple[Path, ...]
    hash: str
    comparison: Comparison | None

    def as_dict(self) -> dict[str, object]:
        """Return what was written and compared, for JSON."""
        compared = None if self.comparison is None else self.comparison.as_dict()
        files = [{"file": str(f), "bytes": f.stat().st_size} for f in self.files]
        return {"folder": str(self.folder), "files": files, "hash": self.hash, "compared": compared}


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
    block, comparison = checked_block(surrogate, check=check)
    files = _package_files(surrogate, name, block)
    files |= {f"{path}.meta": _meta(name, path) for path in _with_folders(files)}
    return ExportedPackage(
        Path(out), write_package(out, files, overwrite=overwrite), block.hash, comparison
    )


def checked_block(surrogate: Surrogate, *, check: bool) -> tuple[WeightsBlock, Comparison | None]:
    """Return a body's weights for an engine, and how far the generic library is from palpate with them."""
    if not surrogate.can_be_touched:
        raise UsageError(
            f"The model {surrogate.name!r} can't be touched.",
            why="A scene asks a body for the force on a tool.",
            fix="Take it out with `palpate export fmu`, `lib`, `c` or `onnx`.",
        )
    mesh = shown_mesh(surrogate)
    block = block_of(
        surrogate, field=None if mesh is None else mesh.name, with_field=mesh is not None, deviation=False
    )
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


def shown_mesh(surrogate: Surrogate) -> FieldSurrogate | None:
    """Return the displacement of a surface that an engine can draw, if the body has one."""
    field = surrogate.fields.get("displacement")
    drawn = isinstance(field, FieldSurrogate) and field.rest.shape[1] == 3
    return field if drawn and isinstance(field, FieldSurrogate) else None


def press_ends(surrogate: Surrogate) -> tuple[np.ndarray, np.ndarray]:
    """Return two places (3,), m, between which a sample leads its tool: free, and in the trained body."""
    energy = surrogate.hand_energy
    k, D = len(energy.baseline.directions), energy.baseline.directions
    middle = np.array([(r.low + r.high) / 2 for r in surrogate.inputs])
    X = energy.trained_rows()
    X[:, k:] = middle[k:]
    if energy.baseline.holds:
        size = np.linalg.norm(X[:, :k] * energy.inside(X)[:, None], axis=1)
        return np.zeros(3), 0.7 * X[np.argmax(size), :k] @ D
    depth = np.where(energy.inside(X), energy.depth(X), -np.inf)
    row = np.argsort(depth)[-max(1, int(np.isfinite(depth).sum()) // 20)]
    evaluate = energy.evaluator()
    evaluate(X[row, :3], middle[3:])
    return X[row, :3] + (depth[row] + _radius(surrogate)) * evaluate.outward, X[row, :3].copy()


def _radius(surrogate: Surrogate) -> float:
    """Return the radius of the ball, m: the middle one of several, 0 of a body that is held."""
    baseline = surrogate.hand_energy.baseline
    if baseline.holds:
        return 0.0
    if baseline.radius_input is None:
        return float(baseline.radius)
    own = surrogate.inputs[baseline.radius_input]
    return (own.low + own.high) / 2


def _vector(place: np.ndarray) -> str:
    return ", ".join(f"{v:.6g}f" for v in np.asarray(place)[[0, 2, 1]])


def _package_files(surrogate: Surrogate, name: str, block: WeightsBlock) -> dict[str, bytes]:
    """Return the files of the package by their relative names, without their meta files."""
    away, deep = press_ends(surrogate)
    radius, holds = _radius(surrogate), surrogate.hand_energy.baseline.holds
    own = f"It is a ball of {1e3 * radius:g} mm radius." if not holds else "The body is held where the tool starts."
    space = name[0].upper() + name[1:]
    words = {
        "@TITLE@": surrogate.name,
        "@RADIUS@": f"{radius:.9g}",
        "@HOLDS@": "true" if holds else "false",
        "@AWAY@": _vector(away),
        "@DEEP@": _vector(deep),
        "@TOOL@": own,
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

    package = "".join(c for c in name.lower() if c.isalnum() or c == "-")
    return {
        "name": f"org.palpate.{package}",
        "version": __version__,
        "displayName": f"palpate: {surrogate.name}",
        "description": "A body learnt from finite-element solves, with force and deformed shape. Tried with Mono and "
        "stand-ins for Unity's types, not in the Unity editor.",
        "unity": "2021.3",
        "license": "MIT",
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
    corners = np.asarray(mesh.triangles)[:, [0, 2, 1]].astype("<i4")  # the frame is mirrored, and with it what is outside
    return struct.pack("<2i", len(places), len(corners)) + places.tobytes() + corners.tobytes()


def _with_folders(files: Mapping[str, bytes]) -> list[str]:
    """Return the names of files and folders that Unity gives meta files: all but those of folders that end in ~."""
    names = set(files) | {str(parent) for path in files for parent in Path(path).parents}
    return sorted(name for name in names if name != "." and "~" not in name)


def _meta(package: str, path: str) -> bytes:
    """Return the meta file of a file or folder: its identity, which depends on its name alone, and its importer."""
    ending = Path(path).suffix
    identity = hashlib.sha256(f"palpate/{package}/{path}".encode()).hexdigest()[:32]
    head = f"fileFormatVersion: 2\nguid: {identity}\n"
    if ending in _PLUGINS:
        return (head + _plugin_importer(*_PLUGINS[ending])).encode()
    if path == "package.json":
        kind = "PackageManifestImporter"
    else:
        kind = _IMPORTERS.get(ending, "DefaultImporter")
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
        f"  - first:\n      : Any\n    second:\n      enabled: 0\n      settings:\n        Exclude Editor: 0\n{excluded}"
        f"{enabled}  userData: \n"
    )
