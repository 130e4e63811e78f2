"""Options that a study beside a part says otherwise: each with the line of the file, its value, and what is asked."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import UsageError
from palpate.options import PartOptions, declarations

if TYPE_CHECKING:
    from palpate.study import Study

__all__ = ["chosen_words", "require_same"]

_KEYS = {
    "unit": ("body", "unit"),
    "material": ("body", "material"),
    "young": ("body", "material", "young"),
    "poisson": ("body", "material", "poisson"),
    "radius": ("interaction", "radius"),
    "depth": ("interaction", "depth"),
    "tool": ("interaction", "shape", "kind"),
    "element": ("sweep", "element"),
    "held": ("body", "fixed"),
    "touched": ("interaction", "touches"),
    "wrap": ("body", "wrap"),
    "labels": ("body", "labels"),
    "up": ("body", "up"),
}
"""Key of a study file that says each option of a part."""


def require_same(file: Path, study: Study, choices: PartOptions) -> None:
    """Refuse options that a study file says otherwise, and name the lines that do."""
    from palpate.study.toml import key_line

    stated = _choices_of(study)
    if choices.element is not None:  # what was measured once stays
        stated["element"] = _element_words(stated.get("element"), choices.element)
    if choices.tool is not None:
        stated["tool"] = _tool_words(study, choices.tool)
    differing = [
        name
        for name, keys in _KEYS.items()
        if (wanted := getattr(choices, name, None)) not in (None, ())
        and not _are_equal(stated.get(name), wanted)
    ]
    if not differing:
        return
    text = file.read_text(encoding="utf-8")
    lines = []
    for name in differing:
        number, line = key_line(text, *_KEYS[name])
        where = f"line {number} says {line}" if number else "it says nothing of it"
        lines.append(f"  {_flag(name)} asks for {_words(name, getattr(choices, name))}; {where}")
    raise UsageError(
        f"{file} exists already, and says otherwise of {', '.join(map(_flag, differing))}.",
        why="\n".join(lines),
        fix="Change these lines and leave the options out, or give a new study another name: --name NAME.",
    )


def chosen_words(study: Study) -> str:
    """Return what was chosen for a part, in one sentence."""
    from palpate.study.probe_kind import ProbeRecord
    from palpate.study.tool_kind import ToolRecord

    assert isinstance(study.interaction, ProbeRecord | ToolRecord)  # nothing else presses a part
    acting, held = study.interaction, ", ".join(study.body.fixed_names())
    held = "what it stands on" if held == "held" else held
    surface = "the surface that faces up" if acting.touches == "touched" else acting.touches
    tool = acting.build_tool() if isinstance(acting, ToolRecord) else f"ball of {1e3 * acting.radius:g} mm"
    return f"Held at {held}; a {tool} presses {surface}, up to {1e3 * acting.depth[1]:g} mm deep."


def _flag(name: str) -> str:
    """Return an option as it is typed."""
    return (declarations(PartOptions)[name].flag or f"--{name}").split()[0]


def _words(name: str, value: Any) -> str:
    """Return the value of an option in words, with its unit."""
    from palpate.format import millimetres, pressure

    unit = declarations(PartOptions)[name].unit
    if unit in {"m", "Pa"}:
        return millimetres(value) if unit == "m" else pressure(value)
    return ", ".join(value) if isinstance(value, tuple) else str(value)


def _choices_of(study: Study) -> dict[str, Any]:
    """Return what the study of a part says of the options."""
    from palpate.study.material_records import SolidMaterialRecord
    from palpate.study.part_records import PartRecord
    from palpate.study.probe_kind import ProbeRecord
    from palpate.study.tool_kind import ToolRecord

    body, acting = study.body, study.interaction
    if not isinstance(body, PartRecord) or not isinstance(acting, ProbeRecord | ToolRecord):
        return {}
    said: dict[str, Any] = {"depth": acting.depth[1], "touched": acting.touches}
    if isinstance(acting, ProbeRecord):
        said["radius"] = acting.radius
    said |= {"wrap": body.wrap, "unit": body.unit, "held": body.fixed_names(), "up": body.up}
    said["labels"] = ",".join(f"{name}={number}" for name, number in body.labels.items())
    said["element"] = getattr(study.sweep, "element", None)
    if isinstance(body.material, str):
        said["material"] = body.material
    elif isinstance(body.material, SolidMaterialRecord):
        said |= {"young": body.material.young, "poisson": body.material.poisson}
    return said


def _element_words(stated: float | None, wanted: str) -> str:
    """Return the wanted element as it was typed where a study states the same, or where solves decided it."""
    from palpate.study.part_study import AUTO
    from palpate.units import parse_quantity

    if wanted == AUTO:
        return wanted
    return wanted if _are_equal(stated, parse_quantity(wanted, "m", "--element", bare=False)) else ""


def _tool_words(study: Study, wanted: str) -> str:
    """Return the wanted tool as it was typed where a study states the same; sizes left out are as stated."""
    from palpate.study.tool_kind import ToolRecord
    from palpate.tools.tool_sizes import BALL, read_tool

    acting = study.interaction
    if not isinstance(acting, ToolRecord):
        return wanted if wanted.strip().lower() == BALL else ""
    stated = acting.build_tool()
    return wanted if _same_tool(read_tool(wanted, stated.shape.size, stated)[1], stated) else ""


def _same_tool(one: Any, other: Any) -> bool:
    """Return whether two tools are the same; sizes may differ by the rounding of a unit."""
    from palpate.tools.tool_sizes import sizes_of

    if one is None or type(one.shape) is not type(other.shape):
        return False
    mine, theirs = sizes_of(one), sizes_of(other)
    return all(math.isclose(mine[key], theirs[key], rel_tol=1e-9, abs_tol=1e-12) for key in mine)


def _are_equal(one: Any, other: Any) -> bool:
    """Return whether two choices are the same; numbers may differ by the rounding of a unit."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=1e-9)
    return bool(one == other)
