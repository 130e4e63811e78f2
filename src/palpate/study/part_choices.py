"""A part on the page of `palpate touch`: what its study shows there, and the study of what a person chooses there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from palpate.errors import UsageError
from palpate.physics import named_material
from palpate.physics.materials.library import MATERIALS, material_kind, material_words
from palpate.physics.shapes.body_file import UNITS, apply_patches
from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.naming import members
from palpate.physics.shapes.step_patches import FacePatches
from palpate.physics.shapes.triangle_list import triangle_text
from palpate.record_complaints import complaints
from palpate.study.material_records import SolidMaterialRecord
from palpate.study.part_records import PartRecord
from palpate.study.part_rim import with_rim
from palpate.study.part_study import HELD, POISSON, TOUCHED, require_suitable_ball
from palpate.study.part_tools import under_ball, under_tool
from palpate.study.probe_kind import ProbeRecord
from palpate.study.region_choices import RegionMaterial, material_texts
from palpate.study.study import Study
from palpate.study.tool_kind import ToolRecord

if TYPE_CHECKING:
    from palpate.viewer.shown_part import PartChoices, ShownMaterial, ShownPart

__all__ = ["LAWS", "chosen_study", "shown_part"]

LAWS = ("neo-hookean", "st-venant-kirchhoff", "linear-elastic")
"""Laws that take Young's modulus and Poisson's ratio alone."""


def shown_part(study: Study) -> ShownPart:
    """Return the part of a study that `part_study` made as the page shows it, with its choices as the first ones."""
    from palpate.viewer.shown_part import PartChoices, ShownPart

    body, acting = _parts(study)
    bare = body.bare()
    skin, names = bare.skin, _names(body)
    own = body.material if isinstance(body.material, SolidMaterialRecord) else None
    plain = own if own is not None and own.law in LAWS and own.young is not None else None
    return ShownPart(
        name=study.name,
        file=Path(body.file).name,
        unit=body.unit or "",
        points=skin.points,
        triangles=skin.triangles,
        face_of=skin.surface_of,
        faces=skin.surfaces,
        held=_marked(names, body.fixed_names()),
        touched=_marked(names, (acting.touches,)),
        choices=PartChoices(
            material=body.material if isinstance(body.material, str) else "",
            law=plain.law if plain else LAWS[0],
            young=plain.young if plain and plain.young else 10e3,
            poisson=plain.poisson if plain else 0.45,
            depth=acting.depth[1],
            regions=_region_texts(study, body),
            **_shown_tool(acting),
        ),
        units=tuple(UNITS) if body.unit else (),
        whole=bool(getattr(bare, "is_cad", False)),
        materials={name: _shown_material(name) for name in MATERIALS if _is_for_solids(name)},
        laws=LAWS,
        notes=tuple(bare.notes),
        judge_region=_region_material,
    )


def _region_material(region: str, text: str) -> RegionMaterial:
    """Return the material of a region by its text, or refuse the text."""
    return RegionMaterial.of_text(region, text, POISSON)


def _region_texts(study: Study, body: PartRecord) -> dict[str, str]:
    """Return the materials of a part's regions as texts; nothing of a part of one region."""
    regions = body.bare().regions
    return material_texts(body.materials, study.varied, regions) if len(regions) > 1 else {}


def chosen_study(study: Study, choices: PartChoices) -> Study:
    """Return the study of a part with the choices of a person in place of its own.

    `study` is what `shown_part` has shown. A misfit is refused: nothing is held or touched, the ball or its depth
    is too large, elements are larger than the ball, or the material can't be.
    """
    body, acting = _parts(study)
    skin = body.bare().skin
    held, touched, surfaces, fixed, touches = _picked(body, acting, skin, choices)
    _require_surfaces(held, touched)
    chosen = {"radius": choices.radius, "depth": choices.depth}
    if choices.posed is not None:
        del chosen["radius"]
    require_suitable_ball(body, skin.points[skin.triangles[touched]], chosen)
    least = float(f"{acting.depth[0] * choices.depth / acting.depth[1]:.6g}")
    content = study.model_dump()
    content["body"] |= {
        "surfaces": surfaces,
        "fixed": fixed,
        "material": _material(body, choices),
    }
    _choose_regions(content, _region_texts(study, body), choices)
    content["interaction"] |= {"touches": touches, "depth": (least, choices.depth)}
    if choices.posed is None:
        content = under_ball(content, choices.radius)
    else:
        content = under_tool(content, choices.tool, choices.posed)
    try:
        return with_rim(Study.model_validate(content))
    except ValidationError as error:
        raise UsageError(" ".join(complaints(error, Study)), fix="Change it on the page.") from error


def _choose_regions(content: dict[str, Any], before: dict[str, str], choices: PartChoices) -> None:
    """Change the materials of regions in a study's content, and what varies of them, where texts have changed."""
    materials = dict(content["body"]["materials"])
    for region, text in choices.regions.items():
        if region not in before or text == before[region]:
            continue
        path = f"{region}.young"
        content["varied"] = [entry for entry in content["varied"] if entry["path"] != path]
        materials.pop(region, None)
        if text:
            chosen = _region_material(region, text)
            materials[region] = chosen.table
            content["varied"] += [chosen.varied] if chosen.varied else []
    content["body"]["materials"] = materials


def _shown_tool(acting: ProbeRecord | ToolRecord) -> dict[str, Any]:
    """Return what presses, as the choices of the page hold it."""
    if isinstance(acting, ProbeRecord):
        return {"radius": acting.radius}
    posed = acting.build_tool()
    return {"radius": posed.shape.size, "tool": acting.shape.kind, "posed": posed}


def _parts(study: Study) -> tuple[PartRecord, ProbeRecord | ToolRecord]:
    """Return body and interaction of a study of a part under a ball or tool."""
    body, acting = study.body, study.interaction
    if not isinstance(body, PartRecord) or not isinstance(acting, ProbeRecord | ToolRecord):
        raise UsageError(
            f"The study {study.name} is not of a part under a ball or a tool.",
            why="Only such a study is set up on the page.",
            fix="Carry it out with `palpate sweep` and `palpate learn`, and look at it with `palpate view`.",
        )
    return body, acting


def _names(body: PartRecord) -> np.ndarray:
    """Return the name of the surface that each triangle (t,) belongs to, by file and study."""
    bare, patches = body.bare(), body.patches()
    skin = bare.skin
    middles = skin.points[skin.triangles].mean(axis=1)
    if getattr(bare, "is_cad", False):  # whole faces are named by their centres
        faces = FacePatches(skin.surfaces, np.array([face.centre for face in bare.faces]), patches)
        return np.array(faces.labels(skin.surface_of, middles, skin.normals), dtype=object)
    names, index = apply_patches(skin.surfaces, skin.surface_of, middles, patches, skin.normals)
    return np.asarray(np.array(names, dtype=object)[index])


def _marked(names: np.ndarray, wanted: Sequence[str]) -> np.ndarray:
    """Return which triangles (t,) belong to surfaces, of which one may be a group."""
    known = tuple(dict.fromkeys(names.tolist()))
    chosen = {name for group in wanted for name in members(group, known)}
    return np.array([name in chosen for name in names.tolist()], dtype=bool)


def _picked(
    body: PartRecord, acting: ProbeRecord | ToolRecord, skin: BodyMesh, choices: PartChoices
) -> tuple[np.ndarray, np.ndarray, list[dict[str, Any]], Any, str]:
    """Return what is held and touched as masks (t,), the named surfaces, the names that are held, and that touched."""
    names = _names(body)
    held, touched = _marked(names, body.fixed_names()), _marked(names, (acting.touches,))
    surfaces = [surface.model_dump() for surface in body.surfaces]
    fixed, touches = body.fixed, acting.touches
    for role, picked, other in ((TOUCHED, choices.touched, choices.held), (HELD, choices.held, None)):
        if picked is None:
            continue
        before = touched if role == TOUCHED else held
        mask, covered = np.zeros(len(before), dtype=bool), np.zeros(len(before), dtype=bool)
        mask[picked] = True
        if other is not None:
            covered[other] = True
        if np.array_equal(mask, before & ~covered):
            continue  # as the study says it, less what is held now, which goes over it
        name, faces = (role if role not in skin.surfaces else f"{role} by hand"), _whole_faces(skin, mask)
        surfaces = [surface for surface in surfaces if surface["name"] != name]
        if mask.any():
            if not faces and getattr(body.bare(), "is_cad", False):
                raise _in_part(skin, mask, role)
            listed = (
                {"faces": faces} if faces else {"triangles": triangle_text(np.flatnonzero(mask), len(mask))}
            )
            surfaces.append({"name": name, **listed})
        if role == HELD:
            held, fixed = mask, name
        else:
            touched, touches = mask, name
    return held, touched & ~held, surfaces, fixed, touches


def _in_part(skin: BodyMesh, mask: np.ndarray, role: str) -> UsageError:
    """Return the error of a pick that takes a face of a CAD file in part."""
    numbers = np.unique(skin.surface_of[mask])
    part = next(n for n in numbers if not mask[skin.surface_of == n].all())
    return UsageError(
        f"Of {skin.surfaces[part]} only a part is {role}.",
        why="Faces of a CAD file are picked whole; the study's own choice of what faces up may cut them.",
        fix=f"Click that face until all of it is {role}, or none; or choose by `facing` in the study file.",
    )


def _whole_faces(skin: BodyMesh, mask: np.ndarray) -> tuple[str, ...]:
    """Return the names of the faces that make up a mask (t,) of triangles; nothing where one is only in part in it."""
    numbers = np.unique(skin.surface_of[mask])
    if not np.array_equal(np.isin(skin.surface_of, numbers), mask):
        return ()
    return tuple(skin.surfaces[number] for number in numbers)


def _require_surfaces(held: np.ndarray, touched: np.ndarray) -> None:
    if not held.any():
        raise UsageError(
            "Nothing is held.", fix="Pick the faces that the part rests on, or where it is clamped, as held."
        )
    if not touched.any():
        raise UsageError("Nothing is touched.", fix="Pick the faces that the ball shall press as touched.")


def _material(body: PartRecord, choices: PartChoices) -> Any:
    """Return the material of the choices; that of the study where it is the one shown."""
    if choices.material:
        return choices.material
    own = body.material
    if isinstance(own, SolidMaterialRecord) and own.law not in LAWS:
        return own.model_dump(exclude_none=True)
    return {
        "law": choices.law,
        "young": choices.young,
        "poisson": choices.poisson,
        "name": "neo-Hookean" if choices.law == LAWS[0] else choices.law,
    }


def _shown_material(name: str) -> ShownMaterial:
    """Return a material of the library as the page shows it."""
    from palpate.viewer.shown_part import ShownMaterial

    material = named_material(name)
    young = 2 * material.shear_modulus * (1 + material.poisson)
    return ShownMaterial(material_words(name), material_kind(name), young, material.poisson)


def _is_for_solids(name: str) -> bool:
    """Return whether a material of the library can be that of a solid that is learnt from rest."""
    return not hasattr(named_material(name), "hardening")
