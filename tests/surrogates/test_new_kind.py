"""A kind of body that palpate does not know: a flat punch on a bed of springs, with a baseline of its own.

Nothing else is written for it, and it goes all the way: solved, learnt, saved, judged, reported, felt and drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from numba import njit
from surrogate_checks import CHECKS, Example

import palpate as pp
from palpate.surrogates import Compiled, Solves

pytestmark = pytest.mark.full  # compiles kernels of its own
MEETS = 0.030  # m, the height at which the punch meets the springs
ENDS = ((-0.02, 0.02), (-0.02, 0.02), (0.022, MEETS))
RANGES = tuple(pp.Range(f"c_{axis}", *ends, "m") for axis, ends in zip("xyz", ENDS, strict=True))


@njit(cache=True)
def even_bed(position, parameters, gradient, hessian, args):
    """U₀ = ½ k s² of even springs, s the depth of the punch."""
    stiffness, meets = args
    s = meets - position[2]
    gradient[:], hessian[:] = 0.0, 0.0
    gradient[2], hessian[2, 2] = -stiffness * s, stiffness
    return 0.5 * stiffness * s * s, s


@pp.register_baseline
@dataclass(frozen=True, eq=False)
class SpringBed(pp.Baseline):
    """Even springs under a punch: what of an uneven bed is known beforehand."""

    name: ClassVar[str] = "spring-bed"

    stiffness: float
    meets: float

    def compiled(self):
        return Compiled(even_bed, (self.stiffness, self.meets))

    @classmethod
    def recognise(cls, data):
        acting = data.provenance.get("problem", {}).get("interactions", [])
        if [a.get("type") for a in acting] != ["FlatPunch"]:
            return None
        data, meets = data.ok, acting[0]["meets"]
        stiffness = np.median(2.0 * data.potential_energy / (meets - data.X[:, 2]) ** 2)
        found = Solves(data.X, data.potential_energy, data.response, data.response_gradient, data.ranges)
        return cls(float(stiffness), meets), found


def uneven_bed(c):
    """Answer for a punch at c (3,): springs that are stiffer along x, stiffen when pressed, and are even along y."""
    s = MEETS - c[2]
    energy = 60.0 * s**2 * np.exp(0.3 * np.sin(80.0 * c[0]) + 20.0 * s)
    slope = np.array([24.0 * np.cos(80.0 * c[0]), 0.0, -2.0 / s - 20.0])  # of ln U
    bend = np.diag([-1920.0 * np.sin(80.0 * c[0]), 0.0, -2.0 / s**2])
    return {
        "displacement": np.zeros((1, 3)),
        "potential_energy": energy,
        "strain_energy": energy,
        "response": -energy * slope,
        "response_gradient": -energy * (np.outer(slope, slope) + bend),
        "penetration": s,
        "least_volume_ratio": 1.0,
    }


@pytest.fixture(scope="module")
def solves():
    from palpate.dataset import solid_fields

    acting = {"type": "FlatPunch", "meets": MEETS}
    problem = pp.ExternalProblem(
        RANGES, pp.Layout(np.zeros((1, 3))), solid_fields(1, RANGES), uneven_bed, {"interactions": [acting]}
    )
    data = pp.sweep(problem, samples=64, workers=1, progress=False)
    return data.take(np.arange(32)), data.take(np.arange(32, 64))


@pytest.fixture(scope="module")
def body(solves):
    return pp.learn(solves[0], name="bed", effort=0.1, workers=1)[0]


@pytest.mark.parametrize("check", CHECKS, ids=[check.__name__ for check in CHECKS])
def test_it_passes_the_checklist(check, body, tmp_path):
    check(Example(body, rest=np.array([[0.0, 0.0, MEETS + 0.001], [0.01, 0.0, MEETS]])), tmp_path)


def test_it_goes_all_the_way(solves, body, tmp_path):
    from palpate.validation import Chapter
    from palpate.viewer import Viewer
    from palpate.viewer.messages import Surface
    from websocket_page import client_of, get

    file = body.save(tmp_path / "bed.palpate")
    judged = pp.validate(pp.load(file), solves[1])
    judged.raise_if_failed()
    report = pp.write_report(tmp_path / "bed.html", [Chapter("bed", body, solves[1], judged)])
    assert "SpringBed(stiffness=" in report.read_text("utf-8")
    stroke = "stroke:frequency=2,amplitude=0.02"
    with Viewer(file, port=0, device=stroke) as viewer, client_of(viewer) as page:
        frames = [page.next_frame() for _ in range(100)]
        drawn = Surface.unpack(get(viewer, "surface").content)
    deep = max(frames, key=lambda frame: frame.depth)
    assert deep.depth > 0.003
    assert not deep.faults
    np.testing.assert_allclose(deep.force, body.energy.force(np.array([deep.position]))[0], atol=1e-4)
    assert len(drawn.triangles)
    assert (page.hello.name, page.hello.holds) == ("bed", False)
