"""The modulus of a slab from the force on a ball: theory's curve and the project's own solves give it back."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.errors import UsageError
from palpate.physics.interactions import Fixed, PrescribedDisplacement, SphereProbe
from palpate.physics.materials import IndentationTest, NeoHookean, StretchTest, Yeoh, fit
from palpate.physics.shapes import Block, FineMesh
from palpate.physics.solid.fit_indentation import hertz_modulus

sys.path.append(str(Path(__file__).parents[2] / "verification"))
from bonded_layer import exact, hertz

FAR = 10.0
RADIUS, THICKNESS, WIDTH = 0.010, 0.020, 0.060
DEPTHS = np.array([0.0005, 0.0012, 0.0020])


@dataclass(frozen=True)
class Corner(SphereProbe):
    """A probe above the block's upright edge at the origin, whose mesh is fine under the contact only."""

    def refinements(self, geometry):
        height = geometry.size[2]
        return (FineMesh(self.touches, 0.0013, (0.0, 0.0, height), (0.005, 0.006, height)),)


def mirror(axis):
    upper = [FAR, FAR, FAR]
    upper["xyz".index(axis)] = 0.0
    box = ((-FAR, -FAR, -FAR), tuple(upper))
    return Fixed(PrescribedDisplacement("side", axis, (-FAR, FAR), sliding=True, within=box), (0.0,))


@pytest.fixture(scope="module")
def solved():
    """Forces of own solves: another mesh, another pad, a ball that comes along another path."""
    block = Block((WIDTH / 2, WIDTH / 2, THICKNESS), element=0.005)
    body = pp.Body(block, NeoHookean(12e3, 0.45), held=(mirror("x"), mirror("y")))
    probe = Corner(RADIUS, pad=2e9, stop=None, depth=(0.0, 0.003), over=((0.0, 0.0), (1e-6, 1e-6)))
    solver = body.problem(probe).open()
    found = [solver.solve((0.0, 0.0, THICKNESS + RADIUS - d)) for d in DEPTHS]
    assert all(f.converged for f in found)
    return IndentationTest(DEPTHS, [4 * f.response[2] for f in found], RADIUS, THICKNESS, WIDTH)


@pytest.mark.full
def test_the_modulus_of_own_solves_is_recovered_within_a_percent(solved, tmp_path):
    found = fit(None, solved, poisson=0.45)
    assert found.material.young == pytest.approx(12e3, rel=0.01)
    assert hertz_modulus(solved, 0.45) == pytest.approx(12e3, rel=0.15)  # small contacts alone
    low, high = found.constants[0].low, found.constants[0].high
    assert low < found.material.young < high
    assert found.record() == {"law": "neo-hookean", "young": found.material.young, "poisson": 0.45}
    assert "given, not fitted" in " ".join(found.notes)
    found.plot(tmp_path / "fit.png")


@pytest.mark.full
@pytest.mark.filterwarnings("ignore:The _QuarterProbe has a radius:palpate.physics.advice.ModelWarning")
def test_the_modulus_of_theorys_curve_is_recovered_within_a_percent():
    """Small depths of a large ball on a bonded layer, as an integral equation has them."""
    contact, radius = 0.005, 0.5
    depth = np.array([0.3, 0.6, 1.0]) * contact**2 / radius
    thickness = contact / 0.2
    force = [hertz(9e3, 0.45, radius, d) * exact(0.45, np.sqrt(radius * d) / thickness) for d in depth]
    record = IndentationTest(depth, force, radius, thickness)
    assert fit(None, record, poisson=0.45).material.young == pytest.approx(9e3, rel=0.01)
    assert hertz_modulus(record, 0.45) == pytest.approx(9e3, rel=0.03)


def test_what_an_indentation_can_not_tell_is_refused():
    solved = IndentationTest(DEPTHS, [hertz(12e3, 0.45, RADIUS, d) for d in DEPTHS], RADIUS, THICKNESS, WIDTH)
    with pytest.raises(UsageError, match="fitted together"):
        fit(None, [solved, StretchTest("uniaxial", [1, 1.1, 1.2], [0, 1, 2], "nominal")])
    with pytest.raises(UsageError, match="one modulus"):
        fit("yeoh", solved, poisson=0.45)
    with pytest.raises(UsageError, match="one modulus"):
        fit(Yeoh, solved, poisson=0.45)
    with pytest.raises(UsageError, match="has no force"):
        fit(None, IndentationTest(DEPTHS, 0 * DEPTHS, RADIUS, THICKNESS), poisson=0.45)
    with pytest.raises(UsageError, match="from 0 to"):
        IndentationTest(DEPTHS * 1000, DEPTHS, RADIUS, THICKNESS)
    with pytest.raises(UsageError, match="radius of the ball"):
        IndentationTest(DEPTHS, DEPTHS, -RADIUS, THICKNESS)
