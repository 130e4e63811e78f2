"""The body in words, from what a sweep wrote down about it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.format import length, plain, pressure, share
from palpate.tools import Gripper, PosedTool

__all__ = ["LINEAR", "body_words", "solid_words", "strain_words"]

LINEAR = 0.05
"""Fibre strain above which hardly any material still follows a linear law."""

_UNNAMED = ("", "linear elastic", "own material")  # names that stand for a law without a name of its own


def body_words(provenance: Mapping[str, Any]) -> str:
    """Return a body as the start of a sentence: what it is, of what, how long, of what section, with or without weight.

    Whatever the provenance does not tell is left out.
    """
    body = provenance.get("problem", {}).get("body", {})
    traits = [f"A {str(body.get('type', 'body')).lower()}{_material(body.get('material'))}"]
    if isinstance(body.get("length"), (int, float)):
        traits.append(f"{length(body['length'])} long")
    if section := _section(body.get("section")):
        traits.append(section)
    if "self_weight" in body:
        traits.append("bending under its own weight" if body["self_weight"] else "without self-weight")
    return ", ".join(traits) + ("," if len(traits) > 1 else "")


def solid_words(data: Any) -> str:
    """Return a solid body in one sentence: shape, size, mesh, materials, supports, what acts on it; may be empty."""
    problem = getattr(data, "provenance", {}).get("problem", {})
    body, acting = problem.get("body", {}), problem.get("interactions", [])
    if "body" in body:  # a family
        body = body["body"]
    if not isinstance(body, Mapping) or "geometry" not in body:
        return ""
    rest = data.rest
    sides = " × ".join(plain(1e3 * side, 3) for side in np.ptp(rest, axis=0))
    name = str(data.provenance.get("words", "")).partition(" (")[0] or "solid"
    size = "" if name.endswith("mm") else f"{sides} mm, "
    parts = [f"{name[:1].upper()}{name[1:]}: {size}{len(rest):,} nodes"]
    materials = body.get("material", {})
    if isinstance(materials, Mapping):
        laws = [f"{region}{_material(law).replace(' of ', ' ', 1)}" for region, law in materials.items()]
        parts.append(", ".join(laws))
    fixed = body.get("fixed", [])
    parts.append(f"fixed at {', '.join(map(str, fixed))}" if fixed else "fixed nowhere")
    parts += [words for item in acting if (words := _acting(item))]
    return "; ".join(parts) + "."


def _acting(item: Any) -> str:
    """Return what acts on a body in words: a ball or a pad and where; empty for anything else."""
    if not isinstance(item, Mapping):
        return ""
    shallow, deep = (1e3 * depth for depth in item.get("depth") or (0.0, 0.0))
    if item.get("type") == "SurfaceTool":
        tool = PosedTool.of(item)
        return f"pressed at {item.get('touches')} by a {tool}, {shallow:.3g} to {deep:.3g} mm deep"
    if item.get("type") == "Pinch":
        return (
            f"pinched at {item.get('touches')} by a {Gripper.of(item)}, {shallow:.3g} to {deep:.3g} mm deep"
        )
    if not isinstance(item.get("radius"), (int, float)):
        return ""
    size = f"of radius {length(item['radius'])}"
    if item.get("type") == "SphereProbe":
        return f"pressed at {item.get('touches')} by a ball {size}, {shallow:.3g} to {deep:.3g} mm deep"
    return f"held at {item.get('touches')} by a glued pad {size}" if item.get("type") == "GluedPad" else ""


def strain_words(*datasets: Dataset) -> str:
    """Return the largest fibre strain of the solves, with a warning where it is large; empty where it is not known."""
    known = [d.ok.data["largest_strain"].values for d in datasets if "largest_strain" in d.data]
    finite = np.abs(np.concatenate([np.ravel(k) for k in known])) if known else np.empty(0)
    finite = finite[np.isfinite(finite)]
    if not finite.size:
        return ""
    largest = float(finite.max())
    text = f"The largest fibre strain is {share(largest)}."
    if largest <= LINEAR:
        return text
    return (
        f"{text} Warning: that is above {share(LINEAR)}, where hardly any material is still linearly elastic; the "
        "network learns what the linear law says there, not what a real body does."
    )


def _material(material: Any) -> str:
    if not isinstance(material, Mapping):
        return ""
    name, young = str(material.get("name", "")), material.get("young")
    stiff = f"E = {pressure(float(young))}" if isinstance(young, (int, float)) else ""
    if name in _UNNAMED:
        return f" of a material of {stiff}" if stiff else ""
    return f" of {name} ({stiff})" if stiff else f" of {name}"


def _section(section: Any) -> str:
    kind = section.get("type") if isinstance(section, Mapping) else None
    if kind == "Circle":
        return f"of circular section with a radius of {length(section['radius'])}"
    if kind == "Rectangle":
        return f"of rectangular section, {length(section['width'])} wide and {length(section['height'])} high"
    if kind == "Section":
        area, moment = plain(section["area"], 3), plain(section["second_moment"], 3)
        return f"of a section with A = {area} m² and I = {moment} m⁴"
    return ""
