"""Learnt bodies for the tests of exporters: every baseline, every memory and a field, made by formula."""

from __future__ import annotations

import functools
import sys
from pathlib import Path

import numpy as np

sys.path += [str(Path(__file__).parent / "surrogates" / part) for part in ("", "surface")]

import skins
from field_made import field
from touch_made import PROBE, SOFT, ball, inside_points, overlap_baseline, touch_energy

import palpate as pp
from held import pad, yielding_rod
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import (
    ConstantBaseline,
    LearntEnergy,
    PadBaseline,
    RestStiffness,
    Stiffening,
    TouchedSurface,
)
from palpate.surrogates.memories import Indentation, IwanElements, Patches, Relaxation

__all__ = ["BODIES", "body", "networks", "random_network", "without_units"]


def random_network(inputs, seed: int, radial: str = "gaussian") -> Network:
    rng, n = np.random.default_rng(seed), len(inputs)
    low, high = np.array([[r.low, r.high] for r in inputs]).T
    return Network(
        tuple(inputs),
        (pp.Quantity("ln U/U0"),),
        factors=rng.normal(0.0, 0.6, (13, min(n, 2), n)),
        shifts=rng.normal(0.0, 0.5, (13, min(n, 2))),
        weights=rng.normal(0.0, 0.1, (1, 13)),
        tail=rng.normal(0.0, 0.1, (1, 1 + n)),
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.zeros(1), np.ones(1)),
        radial=radial,
    )


def _region(n: int) -> TrainedRegion:
    return TrainedRegion.of(np.random.default_rng(1).uniform(-1.0, 1.0, (60, n)))


def _glued_pad() -> pp.Surrogate:
    """A pad with a stiffness and a polynomial that vary with place, and units of the inverse multiquadric."""
    energy, rng = pad().energy, np.random.default_rng(2)
    rest = RestStiffness(np.vstack([[9.0, 0.5, 0.1, 8.0, 0.2, 7.0], rng.normal(0.0, 0.3, (5, 6))]), 2)
    powers = np.array([e for e in np.ndindex(3, 3, 3, 2, 2) if 0 < sum(e) <= 3])
    stiffens = Stiffening(rng.normal(0.0, 0.05, len(powers)), powers)
    network = random_network(energy.inputs, 3, "inverse-multiquadric")
    return pp.Surrogate(
        LearntEnergy(network, PadBaseline(rest, stiffens), region=_region(5)), meta={"name": "pad"}
    )


def _node() -> pp.Surrogate:
    """A node that two loads move, with a load elsewhere as a parameter, and Matérn units."""
    inputs = [
        pp.Range("h_x", -0.02, 0.02, "m"),
        pp.Range("h_y", -0.02, 0.02, "m"),
        pp.Range("Q", 0.0, 3.0, "N"),
    ]
    baseline = ConstantBaseline(0.05, np.array([[0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]))
    energy = LearntEnergy(random_network(inputs, 4, "matern-5/2"), baseline, region=_region(3))
    return pp.Surrogate(energy, meta={"name": "node"})


def _rod() -> pp.Surrogate:
    """A rod along a slanted line, of a spring, two sliders and a dashpot."""
    baseline = PadBaseline(RestStiffness.even([[100.0]]), Stiffening.none(1), np.array([[0.6, -0.8, 0.0]]))
    inf = np.inf
    memory = IwanElements(
        np.array([0.4, 0.2, 0.2, 0.2]),
        np.array([inf, 0.05, 0.1, inf]),
        np.array([0.0, 0.1, 0.0, 0.0]),
        np.array([inf, inf, inf, 0.3]),
    )
    energy = LearntEnergy(random_network(yielding_rod().inputs, 5), baseline)
    return pp.Surrogate(energy, memory=memory, meta={"name": "rod"})


def _organ() -> pp.Surrogate:
    """A ball that relaxes over patches, with a field that varies from place to place."""
    points = np.random.default_rng(6).uniform(-0.015, 0.015, (25, 3)) * [1, 1, 0.1]
    memory = Relaxation(((0.3, 0.05), (0.2, 0.4)), 1e-4, Patches(points, 0.004, 1e-3, 0.002))
    return pp.Surrogate(
        touch_energy(surface=ball()), {"displacement": field(curved=True)}, memory, {"name": "organ"}
    )


def _yielding() -> pp.Surrogate:
    """A flat body of a family, that keeps indentations, under probes of several radii."""
    law = np.array([0.0, 0.01, 0.03]), np.array([0.005, 0.02, 0.05]), np.array([1.0, 1.05, 1.1])
    memory = Indentation(*law, np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]]), 0.005)
    return pp.Surrogate(
        touch_energy(extra=[PROBE, SOFT], radius_at=3), memory=memory, meta={"name": "yielding"}
    )


def _rubbed() -> pp.Surrogate:
    """A flat body that relaxes, under a ball that sticks and slides."""
    relaxes = Relaxation(((0.3, 0.05), (0.2, 0.4)))
    body = pp.Surrogate(touch_energy(), memory=relaxes, meta={"name": "rubbed"})
    return body.with_friction(0.3, 0.4)


def _egg() -> pp.Surrogate:
    """An ellipsoid of 72, 60 and 42 mm, touched from all sides, its top the origin."""
    points, triangles = skins.ball(0.03, 7)
    surface = TouchedSurface.of(
        points * [1.2, 1.0, 0.7] - [0.0, 0.0, 0.021], triangles, radius=0.006, reach=0.013, spacing=0.002
    )
    return pp.Surrogate(touch_energy(surface=surface), meta={"name": "egg"})


def _block() -> pp.Surrogate:
    """A flat body with a field of a family."""
    return pp.Surrogate(
        touch_energy(extra=[SOFT]), {"displacement": field(extra=[SOFT])}, meta={"name": "block"}
    )


def _grooved() -> pp.Surrogate:
    """A face with a groove, by the overlap of the ball."""
    return pp.Surrogate(touch_energy(baseline=overlap_baseline()), meta={"name": "grooved"})


BODIES = {
    "contact": _block,
    "relaxation": _organ,
    "closed": _egg,
    "overlap": _grooved,
    "indentation": _yielding,
    "friction": _rubbed,
    "pad": _glued_pad,
    "constant": _node,
    "iwan": _rod,
}
"""Bodies by what they are there for."""


@functools.cache
def body(name: str) -> pp.Surrogate:
    """Return one of them."""
    return BODIES[name]()


def without_units() -> tuple[pp.Surrogate, np.ndarray]:
    """Return a body whose network is a slope alone, and places in touch."""
    model = pp.Surrogate(touch_energy(units=0), meta={"name": "plain"})
    return model, inside_points(20)


def networks() -> list[Network]:
    """Return networks alone: of few outputs, and of many through modes."""
    rng = np.random.default_rng(7)
    inputs = [pp.Range("a", -1.0, 2.0, "m"), pp.Range("b", 0.0, 5.0, "N")]
    X = rng.uniform([-1, 0], [2, 5], (60, 2))
    Y = np.column_stack([np.sin(X[:, 0]) * X[:, 1], X[:, 0] ** 2, np.exp(-X[:, 1])])
    some = pp.fit(X, Y, inputs, effort=0.02, workers=1).network
    basis = np.linalg.qr(rng.normal(size=(12, 2)))[0]
    few = random_network(inputs, 8)
    wide = Network(
        few.inputs,
        tuple(pp.Quantity(f"y{i}") for i in range(12)),
        few.factors,
        few.shifts,
        rng.normal(size=(2, 13)),
        rng.normal(size=(2, 3)),
        Scaling(few.scaling.input_centre, few.scaling.input_half, rng.normal(size=12), np.full(12, 2.0)),
        basis=basis,
    )
    return [some, wide]
