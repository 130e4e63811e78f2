"""Imported touches whose force and energy contradict each other by sign, unit, axis or order are told."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp

STIFFNESS = 4 / 3 * 9e3 / (1 - 0.45**2) * 0.01**0.5  # of Hertz's half-space under a ball of 10 mm, N/m^1.5
BEND = 10.0  # 1/m: of the surface z = 0.06 + BEND/2·r², so that all components are there


def touches(count=40, seed=0, noise=0.0, flat=False):
    """Return places (N, 3), forces on the probe (N, 3) and energies (N,) of U = 0.4 k d^2.5."""
    rng = np.random.default_rng(seed)
    place = np.column_stack([rng.uniform(-0.02, 0.02, (count, 2)), 0.06 - rng.uniform(0.0, 0.006, count)])
    bend = 0.0 if flat else BEND
    depth = np.maximum(0.06 + bend / 2 * (place[:, :2] ** 2).sum(1) - place[:, 2], 0.0)
    slope = np.column_stack([bend * place[:, :2], -np.ones(count)])  # of the depth
    force, energy = -STIFFNESS * depth[:, None] ** 1.5 * slope, 0.4 * STIFFNESS * depth**2.5
    factors = 1 + noise * rng.normal(size=(count, 2))
    return place, force * factors[:, :1], energy * factors[:, 1]


def notes(folder, place, force, energy, **changes):
    """Return what an import says of them."""
    columns = dict(zip(("x", "y", "z"), place.T, strict=True)) | dict(
        zip(("fx", "fy", "fz"), force.T, strict=True)
    )
    points = np.array([[x, y, z] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (0.0, 0.06)])
    move = np.zeros((len(place), len(points), 3))
    np.savez(folder / "touches.npz", points=points, displacement=move, u=energy, **columns)
    units = {"c": "m", "f": "N", "u": "J"} | changes
    mapping = {
        "units": {"length": "m"},
        "inputs": [{"name": f"c_{a}", "from": a, "unit": units["c"]} for a in "xyz"],
        "outputs": [
            {"name": "response", "from": ["fx", "fy", "fz"], "unit": units["f"]},
            {"name": "potential_energy", "from": "u", "unit": units["u"]},
            {"name": "displacement", "from": "displacement", "unit": "m"},
        ],
    }
    return " ".join(pp.import_results(folder / "touches.npz", mapping).notes)


@pytest.mark.parametrize("count", [9, 40, 400])
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("flat", [False, True])
def test_force_and_energy_that_fit_are_not_spoken_of(tmp_path, count, noise, flat):
    assert "Warning" not in notes(tmp_path, *touches(count, noise=noise, flat=flat))


@pytest.mark.parametrize(("count", "noise", "flat"), [(12, 0.0, True), (40, 0.1, False), (400, 0.1, True)])
@pytest.mark.parametrize(
    ("change", "said", "cause"),
    [
        ({"force": -1.0}, "has another sign than the response", "the force on the body"),
        ({"u": "kJ"}, "a thousand times the response", "mJ"),  # as mJ would be that are read as J
        ({"f": "kN"}, "a thousandth of the response", "mm"),
        ({"c": "km"}, "a thousandth of the response", "they go farther than the body is large"),
        ({"u": "mJ"}, "a thousandth of the response", "energy in J read as mJ"),
        ({"u": "GJ", "f": "kN"}, "a million times the response", "µJ"),
        (
            {"force": -1.0, "u": "kJ"},
            "has another sign than the response and is a thousand times",
            "on the body",
        ),
        ({"energy": 4.0}, "times the response", "half or quarter model"),
    ],
)
def test_another_sign_or_unit_is_told_with_its_likely_cause(
    tmp_path, count, noise, flat, change, said, cause
):
    place, force, energy = touches(count, noise=noise, flat=flat)
    units = {key: value for key, value in change.items() if isinstance(value, str)}
    text = notes(tmp_path, place, change.get("force", 1) * force, change.get("energy", 1) * energy, **units)
    assert "Warning: energy and response contradict each other" in text
    assert said in text
    assert cause in text


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_axis_of_another_sign_is_named(tmp_path, axis):
    place, force, energy = touches(60)
    force[:, axis] *= -1
    assert f"along c_{'xyz'[axis]} the response has another sign" in notes(tmp_path, place, force, energy)


def test_components_in_another_order_are_told(tmp_path):
    place, force, energy = touches(60)
    assert "columns in another order" in notes(tmp_path, place, force[:, [1, 2, 0]], energy)


@pytest.mark.parametrize(("count", "noise"), [(2, 0.0), (3, 0.0), (9, 3.0)])
def test_too_few_touches_are_not_judged(tmp_path, count, noise):
    text = notes(tmp_path, *touches(count, noise=noise))
    assert f"can't be judged from these {count} cases" in text
    assert "Warning" not in text


def test_loads_and_deflections_are_compared_alike(tmp_path):
    load = np.linspace(0.0, 5.0, 12)  # N, on a spring of 200 N/m: w = P/200 = −dΠ/dP with Π = −P²/400
    np.savez(tmp_path / "a.npz", P=load, w=load / 200, U=-(load**2) / 400)

    def said(times):
        outputs = [{"name": "response", "from": "w", "unit": "m", "times": times}]
        outputs.append({"name": "potential_energy", "from": "U", "unit": "J"})
        mapping = {"inputs": [{"name": "P", "unit": "N"}], "outputs": outputs}
        return " ".join(pp.import_results(tmp_path / "a.npz", mapping).notes)

    assert "contradict" not in said(1)
    assert "has another sign" in said(-1)
    assert "a thousandth of" in said(1000)


@pytest.mark.parametrize("seed", range(8))
def test_cases_in_the_air_are_no_contradiction(tmp_path, seed):
    place, force, energy = touches(14, seed=seed, flat=True)
    lifted = place + np.array([0.0, 0.0, 0.004])  # two of three don't touch
    depth = np.maximum(0.06 - lifted[:, 2], 0.0)
    force[:, 2], energy = STIFFNESS * depth**1.5, 0.4 * STIFFNESS * depth**2.5
    assert "Warning" not in notes(tmp_path, lifted, force, energy)
