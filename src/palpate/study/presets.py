"""Studies that have a name: the founding study's cantilevers, others that remember, and bodies to be pressed."""

from __future__ import annotations

import difflib
from typing import Any

from pydantic import ValidationError

from palpate.errors import UsageError
from palpate.physics import Cantilever, Circle, PointLoad
from palpate.physics.beam.beam_presets import PRESETS, preset
from palpate.study.held.presets import HELD, held_preset
from palpate.study.models import Study
from palpate.study.stages import AnyStudy
from palpate.study.touching.presets import TOUCHED, touched_preset

__all__ = ["named", "preset_names", "preset_study"]

# a network of several inputs has more to learn: more units, more solves, and a target that a person can feel
_SEVERAL: dict[str, Any] = {
    "test": {"every": 4},
    "learning": {"samples": 0, "units_max": 48, "target": 2e-5, "starts": 2},
    "target": {"rmse": 1e-3, "filter_rmse": 0.0, "filter_outer_ratio": 0.0},
}


def preset_names() -> tuple[str, ...]:
    """Names of studies that a study file can begin with."""
    return (*PRESETS, *TOUCHED)


def named(study: AnyStudy, name: str) -> AnyStudy:
    """The study under another name.

    Raises
    ------
    UsageError
        If files can't have that name.
    """
    try:
        return type(study).model_validate(study.model_dump() | {"name": name})
    except ValidationError as error:
        raise UsageError(
            f"{name!r} can't name a study and its files.",
            fix="Use letters, digits, dots, dashes and underscores, a letter or a digit first.",
        ) from error


def preset_study(name: str, *, quick: bool = False) -> AnyStudy:
    """The study of that name; of a pressed body or one that remembers also in a quick form.

    A beam that remembers nothing has no quick form: all of it takes less than a minute.

    Raises
    ------
    UsageError
        If the name is not known; the message lists the names that are.
    """
    if name in TOUCHED:
        return touched_preset(name, quick=quick)
    if name in HELD:
        return held_preset(name, quick=quick)
    if name not in PRESETS:
        raise _no_study(name)
    return _beam(name)


def _beam(name: str) -> Study:
    found = preset(name)
    body, loads = found.body, [load for load in found.loads if isinstance(load, PointLoad)]
    content: dict[str, Any] = {
        "name": found.name,
        "body": {
            "length": body.length,
            "section": {"radius": _radius_of(body)},
            "material": body.material.name,
            "elements": body.elements,
            "order": body.order,
        },
        "loads": [
            {"name": p.name, "at": p.at, "low": p.low, "high": p.high, "direction": p.direction}
            for p in loads
        ],
        "sweep": {"design": found.design, "samples": found.samples},
    }
    if len(loads) > 1:
        content |= _SEVERAL
    elif body.material.name == "copper":
        # stiffer, so nearly linear over these loads: more can be asked of the filter
        content["target"] = {"filter_rmse": 1e-4}
    elif loads[0].high > 5.0:
        # at 10 N nylon is at P L²/EI = 10, where the tip has turned by 80°: the filter alone comes this far
        content["target"] = {"filter_rmse": 2e-3}
    return Study.model_validate(content)


def _no_study(name: str) -> UsageError:
    known = (*preset_names(), *HELD)
    close = difflib.get_close_matches(name, known, n=1)
    return UsageError(
        f"There is no study called {name!r}.",
        why=f"Known studies: {', '.join(known)}.",
        fix=f"Did you mean {close[0]!r}?" if close else "Choose one of these, or write a study file.",
    )


def _radius_of(body: Cantilever) -> float:
    if not isinstance(body.section, Circle):
        raise TypeError(f"the preset's section is a {type(body.section).__name__}, not a circle")
    return body.section.radius
