"""Studies that have a name: beams, beams with memory, bodies pressed by a ball or a fingertip, one held by a pad.

Most have a quick form, which shows the whole way within two minutes: coarse elements, few solves, less depth. It asks
for less, since it shows the way and not what can be reached.
"""

from __future__ import annotations

from typing import Any

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.physics import Cantilever, Circle, PointLoad
from palpate.physics.beam.beam_presets import PRESETS, preset
from palpate.study.study import Study

__all__ = ["QUICK", "preset_names", "preset_study"]

QUICK = "-quick"
"""End of the name of a study in its quick form, so that its files are not taken for those of the whole study."""

_SOLIDS: dict[str, dict[str, Any]] = {
    "block": {
        "body": {"kind": "block", "size": (0.10, 0.10, 0.05), "material": {"young": 9e3, "name": "tissue"}},
        "interaction": {"depth": (2e-4, 0.012), "over": ((0.0, 0.0), (0.10, 0.10))},
        # places tell more than depths; elements of 3.5 mm instead of 5 take twice as long for the same force
        "sweep": {"samples": 40, "depths": 2},
    },
    "layered": {
        "body": {
            "kind": "layered",
            "extent": (0.10, 0.10),
            "layers": (
                {"name": "skin", "thickness": 0.003, "material": {"young": 30e3, "name": "skin"}},
                {"name": "fat", "thickness": 0.009, "material": {"young": 4e3, "name": "fat"}},
                {"name": "muscle", "thickness": 0.028, "material": {"young": 15e3, "name": "muscle"}},
            ),
        },
        "interaction": {"depth": (2e-4, 0.012), "over": ((0.02, 0.02), (0.08, 0.08))},
        "sweep": {"samples": 80, "depths": 3},
    },
    "breast-dome": {
        "body": {
            "kind": "dome",
            "radius": 0.06,
            "height": 0.045,
            "material": {"young": 6e3, "name": "gland and fat"},
            "skin": {"thickness": 0.003, "material": {"young": 20e3, "name": "skin"}},
        },
        "interaction": {"depth": (2e-4, 0.012), "over": ((-0.045, -0.045), (0.045, 0.045))},
        "sweep": {"samples": 80, "depths": 3, "element": 0.004},  # off by 1 % against 2 mm
    },
    "liver": {
        "body": {"kind": "organ", "length": 0.20, "material": {"young": 6e3, "name": "liver"}},
        "interaction": {"touches": "front", "depth": (2e-4, 0.015)},
        "sweep": {"samples": 200, "depths": 3},
        "learning": {"units_max": 120},
    },
    "phantom": {
        "body": {
            "kind": "dome",
            "radius": 0.05,
            "height": 0.04,
            "material": "ecoflex 00-30",
            "inclusion": {"centre": (0.0, 0.0, 0.02), "radius": 0.008, "material": "dragon skin 30"},
        },
        # silicone is stiff: a pad of 2e6 would take more than half of what the hand presses
        "interaction": {"depth": (2e-4, 0.010), "over": ((-0.03, -0.03), (0.03, 0.03)), "pad": 2e7},
        "sweep": {"samples": 80, "depths": 3, "element": 0.004},  # nothing thin is near the surface
    },
    "fingertip": {
        "body": {"kind": "block", "size": (0.10, 0.10, 0.05), "material": {"young": 9e3, "name": "tissue"}},
        "interaction": {
            "kind": "tool",
            "shape": {"kind": "fingertip"},
            "depth": (2e-4, 0.006),
            "over": ((0.03, 0.03), (0.07, 0.07)),
        },
        "sweep": {"samples": 40, "depths": 4},
        "test": {"samples": 24},
    },
    "grasp": {
        "body": {"kind": "block", "size": (0.06, 0.06, 0.03), "material": {"young": 9e3, "name": "tissue"}},
        "interaction": {"kind": "pad", "radius": 0.012, "over": ((0.025, 0.025), (0.035, 0.035))},
        "sweep": {"samples": 24},
    },
}
"""What each study says; everything else is the record's default."""

_COARSE: dict[str, tuple[float, float, dict[str, Any]]] = {
    # largest element and element under what touches, m, and what acts less deep or less far
    "block": (0.025, 0.010, {"depth": (2e-4, 0.006)}),
    "layered": (0.025, 0.010, {"depth": (2e-4, 0.006)}),
    "breast-dome": (0.020, 0.010, {"depth": (2e-4, 0.006)}),
    "liver": (0.030, 0.012, {"depth": (2e-4, 0.008)}),
    "phantom": (0.020, 0.010, {"depth": (2e-4, 0.005)}),
    "fingertip": (0.025, 0.005, {"depth": (2e-4, 0.004)}),
    "grasp": (0.020, 0.012, {}),
}
# thin layers and round bodies keep more elements, so that a solve takes longer; of liver and phantom it takes 5 s, and
# a part is pressed. The liver's elements are coarse even so: a larger ball feels less of them
_LESS: dict[str, dict[str, dict[str, Any]]] = {
    "block": {"sweep": {"samples": 24}, "test": {"samples": 12}},
    "layered": {"sweep": {"samples": 24}, "test": {"samples": 12}},
    "breast-dome": {"sweep": {"samples": 24}, "test": {"samples": 12}},
    "liver": {
        "interaction": {"over": ((-0.04, -0.02), (0.0, 0.02)), "radius": 0.020},
        "sweep": {"samples": 12},
        "test": {"samples": 8},
    },
    "phantom": {
        "interaction": {"over": ((-0.015, -0.015), (0.015, 0.015))},
        "sweep": {"samples": 16},
        "test": {"samples": 8},
    },
    "fingertip": {"sweep": {"samples": 12}, "test": {"samples": 8}},
    "grasp": {"sweep": {"samples": 12}, "test": {"samples": 12}},
}
_QUICK: dict[str, Any] = {
    "test": {"samples": 24},
    "learning": {"effort": 0.3, "units_max": 64},
    # coarse elements show through and few touches can't tell them from the body: softer limits than a whole study's
    "target": {
        "force_median": 0.035,
        "force_p95": 0.10,
        "light_force_p95": 0.10,
        "stiffness_p95": 0.20,
        "direction_p95": 10.0,
        "mesh_force": 0.20,
        "displacement_mean": 3.5e-4,
        "displacement_max": 2e-3,
        "smoothness": 0.0,
        "coverage": (0.0, 1.0),
    },
}


_NYLON: dict[str, Any] = {"young": 2e9, "poisson": 0.43, "density": 1150.0}

_MEMORY: dict[str, dict[str, Any]] = {
    "beam-plastic": {
        "body": {"material": "annealed copper", "fibres": 48},
        "interaction": {"loads": ({"name": "P", "low": -25.0, "high": 25.0},)},
        "memory": {"histories": 10, "unseen": 14},
    },
    "beam-viscoelastic": {
        # the Prony series is an illustration, no measurement: nylon's depends on its kind, moisture and temperature
        "body": {"material": {**_NYLON, "name": "creeping nylon", "prony": ((0.3, 0.1), (0.2, 2.0))}},
        "interaction": {"loads": ({"name": "P", "low": -5.0, "high": 5.0},)},
        "memory": {"histories": 4, "unseen": 3},
    },
}
_COARSE_BEAM: dict[str, Any] = {"elements": 8, "tolerance": 1e-4}
_QUICK_MEMORY: dict[str, dict[str, Any]] = {
    "beam-plastic": {"body": {"fibres": 24}, "memory": {"histories": 3, "unseen": 2}},
    "beam-viscoelastic": {"memory": {"histories": 2, "unseen": 2, "step": 0.1}},
}

# a network of several inputs has more to learn: more units, more solves, and a target that a person can feel
_SEVERAL: dict[str, Any] = {
    "test": {"every": 4},
    "learning": {"samples": 0, "units_max": 48, "target": 2e-5, "starts": 2},
    "target": {"rmse": 1e-3, "filter_rmse": 0.0, "filter_outer_ratio": 0.0},
}


def preset_names() -> tuple[str, ...]:
    """Return the names of all studies, from which a study file can begin."""
    return (*PRESETS, *_MEMORY, *_SOLIDS)


def preset_study(name: str, *, quick: bool = False) -> Study:
    """Return the study of a name.

    Parameters
    ----------
    name : str
        One of `preset_names`, such as ``"block"``.
    quick : bool
        Whether to return the quick form. A beam without memory has none: all of it takes less than a minute.

    Raises
    ------
    UsageError
        If the name is not known; the message lists the names that are.
    """
    if name in _SOLIDS:
        content: dict[str, Any] = {"name": name, **_SOLIDS[name]}
        return Study.model_validate(_quick_solid(name, content) if quick else content)
    if name in _MEMORY:
        content = {"name": name, **_MEMORY[name]}
        return Study.model_validate(_quick_memory(name, content) if quick else content)
    if name in PRESETS:
        return _beam(name)
    raise UsageError(
        f"There is no study called {name!r}.",
        why=f"Known studies: {', '.join(preset_names())}.",
        fix=did_you_mean(name, preset_names(), shown=repr) or "Choose one of these, or write a study file.",
    )


def _quick_solid(name: str, content: dict[str, Any]) -> dict[str, Any]:
    coarse, element, acting = _COARSE[name]
    content = _merged(content, _QUICK)
    content = _merged(content, {"name": name + QUICK, "body": {"element": coarse}, "interaction": acting})
    content["sweep"] = {"samples": 32, "element": element}
    if content["interaction"].get("kind", "probe") != "pad":
        content = _merged(content, {"sweep": {"depths": 2}, "test": {"depths": 4}})
    return _merged(content, _LESS.get(name, {}))


def _quick_memory(name: str, content: dict[str, Any]) -> dict[str, Any]:
    content = _merged(content, {"name": name + QUICK, "body": _COARSE_BEAM})
    return _merged(content, _QUICK_MEMORY[name])


def _merged(content: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return the content with changes, table by table."""
    tables = {
        key: {**content.get(key, {}), **value} if isinstance(value, dict) else value
        for key, value in changes.items()
    }
    return {**content, **tables}


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
        "interaction": {
            "loads": [
                {"name": p.name, "at": p.at, "low": p.low, "high": p.high, "direction": p.direction}
                for p in loads
            ]
        },
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


def _radius_of(body: Cantilever) -> float:
    if not isinstance(body.section, Circle):
        raise TypeError(f"the preset's section is a {type(body.section).__name__}, not a circle")
    return body.section.radius
