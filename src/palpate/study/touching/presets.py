"""Bodies that have a name, and for each a quick form that shows the whole way within two minutes.

The quick form has coarse elements, few touches and less depth, and asks for less: it shows the way, not what can be
reached.
"""

from __future__ import annotations

from typing import Any

from palpate.study.touching.records import TouchStudy

__all__ = ["QUICK", "TOUCHED", "touched_preset"]

QUICK = "-quick"
"""Ends the name of a study in its quick form, so that its files are not taken for those of the whole."""

TOUCHED: dict[str, dict[str, Any]] = {
    "block": {
        "body": {"kind": "block", "size": (0.10, 0.10, 0.05), "material": {"young": 9e3, "name": "tissue"}},
        "probe": {"depth": (2e-4, 0.012), "over": ((0.0, 0.0), (0.10, 0.10))},
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
        "probe": {"depth": (2e-4, 0.012), "over": ((0.02, 0.02), (0.08, 0.08))},
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
        "probe": {"depth": (2e-4, 0.012), "over": ((-0.045, -0.045), (0.045, 0.045))},
        "sweep": {"samples": 80, "depths": 3, "element": 0.004},  # off by 1 % against 2 mm
    },
    "liver": {
        "body": {"kind": "organ", "length": 0.20, "material": {"young": 6e3, "name": "liver"}},
        "probe": {"touches": "front", "depth": (2e-4, 0.015)},
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
        "probe": {"depth": (2e-4, 0.010), "over": ((-0.03, -0.03), (0.03, 0.03)), "pad": 2e7},
        "sweep": {"samples": 80, "depths": 3, "element": 0.004},  # nothing thin is near the surface
    },
}
"""What each study says; everything else is the record's default."""

_COARSE: dict[str, tuple[float, float, float]] = {
    # largest element, element under the ball and depth, m
    "block": (0.025, 0.010, 0.006),
    "layered": (0.025, 0.010, 0.006),
    "breast-dome": (0.020, 0.010, 0.006),
    "liver": (0.030, 0.012, 0.008),
    "phantom": (0.020, 0.010, 0.005),
}
# thin layers and round bodies keep more elements, so that a solve takes longer; of liver and phantom it takes 5 s, and
# a part is pressed. The liver's elements are coarse even so: a larger ball feels less of them
_LESS: dict[str, dict[str, dict[str, Any]]] = {
    "layered": {"sweep": {"samples": 24}, "test": {"samples": 12}},
    "breast-dome": {"sweep": {"samples": 24}, "test": {"samples": 12}},
    "liver": {
        "probe": {"over": ((-0.04, -0.02), (0.0, 0.02)), "radius": 0.020},
        "sweep": {"samples": 12},
        "test": {"samples": 8},
    },
    "phantom": {
        "probe": {"over": ((-0.015, -0.015), (0.015, 0.015))},
        "sweep": {"samples": 16},
        "test": {"samples": 8},
    },
}
_QUICK: dict[str, Any] = {
    "test": {"samples": 24, "depths": 4},
    "learning": {"seconds": 10.0, "units_max": 64},
    # coarse elements show through and few touches can't tell them from the body: softer limits than a whole study's
    "target": {
        "force_median": 0.035,
        "force_p95": 0.10,
        "light_force_p95": 0.10,
        "stiffness_p95": 0.20,
        "direction_p95": 10.0,
        "displacement_mean": 3.5e-4,
        "displacement_max": 2e-3,
        "smoothness": 0.0,
        "coverage": (0.0, 1.0),
    },
}


def touched_preset(name: str, *, quick: bool = False) -> TouchStudy:
    """The study of a pressed body of that name, which must be in `TOUCHED`."""
    content: dict[str, Any] = {"name": name, **TOUCHED[name]}
    if not quick:
        return TouchStudy.model_validate(content)
    coarse, element, depth = _COARSE[name]
    content |= _QUICK
    content["name"] = name + QUICK
    content["body"] = {**content["body"], "element": coarse}
    content["probe"] = {**content["probe"], "depth": (2e-4, depth)}
    content["sweep"] = {"samples": 32, "depths": 2, "element": element}
    for section, less in _LESS.get(name, {}).items():
        content[section] = {**content[section], **less}
    return TouchStudy.model_validate(content)
