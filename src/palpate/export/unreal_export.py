"""Export as a plugin of Unreal: a component and the sources in C, which Unreal compiles for its own platforms."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.export.c_export import ExportedC, export_c
from palpate.export.core_source import fill_template
from palpate.export.engine_scene import probe_radius, require_touch, shown_mesh, tool_words
from palpate.export.package_folder import ExportedPackage, write_package
from palpate.surrogates import FieldSurrogate, Surrogate

__all__ = ["export_unreal"]

_CENTIMETRES = 100.0  # in a metre
_MIRRORED = np.array([1.0, -1.0, 1.0]) * _CENTIMETRES


def export_unreal(
    surrogate: Surrogate,
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    check: bool = True,
    compiler: str | None = None,
    overwrite: bool = False,
) -> ExportedPackage:
    """Write a learnt body as a plugin of Unreal, its sources compared with palpate at 1,000 places.

    Parameters
    ----------
    surrogate : Surrogate
        A body that a hand feels; with a displacement of its surface the plugin draws it.
    out : path
        Folder of the plugin, made in one that exists.
    name : str, optional
        Beginning of all names in C; the module is called Palpate and this name. By default the body's name.
    check : bool
        Whether the sources are compiled and compared, if there is a C compiler.
    compiler : str, optional
        Name of the C compiler; by default that of the variable CC, or the first one found.
    overwrite : bool
        True replaces files of an earlier export that somebody changed.

    Raises
    ------
    UsageError
        If the name is no identifier, a part of the body has no C source, or a file in the folder is somebody else's.
    AccuracyError
        If the compiled sources differ from palpate by more than they may; nothing is written.
    """
    require_touch(surrogate)
    mesh = shown_mesh(surrogate)
    with tempfile.TemporaryDirectory() as place:
        done = export_c(
            surrogate,
            Path(place) / "c",
            name=name,
            field=None if mesh is None else mesh.name,
            with_field=mesh is not None,
            deviation=False,
            check=check,
            compiler=compiler,
        )
        files = _plugin_files(surrogate, done, mesh)
    return ExportedPackage(
        Path(out), write_package(out, files, overwrite=overwrite), done.hash, done.comparison
    )


def _plugin_files(surrogate: Surrogate, done: ExportedC, mesh: FieldSurrogate | None) -> dict[str, bytes]:
    """Return the files of the plugin by their relative names."""
    name, memory = done.name, surrogate.memory
    upper = name[0].upper() + name[1:]
    module = f"Palpate{upper}"
    parts = ["ELASTIC"] if memory is None else ["MEMORY"] + ["RELEASE"] * memory.moves_rest
    parts.append("TORQUE" if surrogate.torque_evaluator is not None else "TORQUELESS")
    parts.append("SHAPELESS" if mesh is None else "FIELD")
    words = {
        "@TITLE@": surrogate.name,
        "@HASH@": done.hash,
        "@RADIUS@": f"{_CENTIMETRES * probe_radius(surrogate):.9g}",
        "@HOLDS@": "true" if surrogate.hand_energy.baseline.holds else "false",
        "@API@": f"{module.upper()}_API",
        "@TOOL@": tool_words(surrogate),
        "@BODY@": f"{upper}Body",
        "MODULE": module,
        "NAME": name,
    }
    source = f"Source/{module}"
    texts = {
        "README.md": "unreal_readme.md",
        f"{source}/{module}.Build.cs": "unreal_build.cs",
        f"{source}/Public/{name}_unreal.h": "unreal_body.h",
        f"{source}/Public/{module}Component.h": "unreal_component.h",
        f"{source}/Private/{module}Component.cpp": "unreal_component.cpp",
    }
    files = {path: fill_template(template, words, parts).encode() for path, template in texts.items()}
    begin = '#include "Modules/ModuleManager.h"\n\n'
    files[f"{source}/Private/{module}Module.cpp"] = (
        f"{begin}IMPLEMENT_MODULE(FDefaultModuleImpl, {module})\n".encode()
    )
    files[f"{module}.uplugin"] = (json.dumps(_descriptor(surrogate, module), indent=2) + "\n").encode()
    for file in done.files:
        if file.name.startswith(name):
            kind = {".h": f"{source}/Public", ".c": f"{source}/Private"}.get(file.suffix, "Resources")
            files[f"{kind}/{file.name}"] = file.read_bytes()
    if mesh is not None:
        files[f"{source}/Private/{name}_mesh.h"] = _mesh_header(name, mesh).encode()
    return files


def _descriptor(surrogate: Surrogate, module: str) -> dict[str, object]:
    from palpate.version import __version__

    return {
        "FileVersion": 3,
        "Version": 1,
        "VersionName": __version__,
        "FriendlyName": f"palpate: {surrogate.name}",
        "Description": "A body learnt from finite-element solves. Compiled with g++ and stand-ins for Unreal's types, "
        "not in the Unreal editor.",
        "Category": "Physics",
        "CreatedBy": "palpate",
        "CanContainContent": False,
        "Modules": [{"Name": module, "Type": "Runtime", "LoadingPhase": "Default"}],
        "Plugins": [{"Name": "ProceduralMeshComponent", "Enabled": True}],
    }


def _mesh_header(name: str, mesh: FieldSurrogate) -> str:
    """Return points and triangles at rest as tables of C++: in cm and Unreal's frame, which mirrors their corners."""
    rest = (np.asarray(mesh.points) * _MIRRORED).tolist()
    corners = np.asarray(mesh.triangles).tolist()

    def lines(rows: Sequence[Sequence[float]], form: str) -> str:
        return ",\n".join("    {" + ", ".join(format(v, form) for v in row) + "}" for row in rows)

    flat = lines(corners, "d").replace("{", "").replace("}", "")
    return (
        f"// {name} at rest: nodes in the order of the learnt field, cm, and corners of triangles.\n#pragma once\n"
        f"#define {name}_TRIANGLES {len(corners)}\n"
        f"static const float {name}_rest[{len(rest)}][3] = {{\n{lines(rest, '.7g')}\n}};\n"
        f"static const int32 {name}_corners[{3 * len(corners)}] = {{\n{flat}\n}};\n"
    )
