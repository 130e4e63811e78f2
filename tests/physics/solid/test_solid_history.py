"""Bodies with a history under a probe: limits of fast and slow, relaxation, and steps that fail."""

from __future__ import annotations

import numpy as np
import pytest
from solids import SIZE, above, gel

from palpate.errors import UsageError
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import Viscoelastic
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

SHARE, TIME = 0.4, 2.0
PROBE = SphereProbe(radius=0.01, depth=(0.0, 0.005))
PLACE = above(0.003)


def problem(material):
    return Body(Block(SIZE, element=0.03), material).problem(PROBE, element=0.018)


@pytest.fixture(scope="module")
def solver():
    return problem(Viscoelastic(gel(), ((SHARE, TIME),))).open()


@pytest.fixture(scope="module")
def elastic():
    return problem(gel()).solve(PLACE, fields=True)


def test_an_instant_is_elastic(solver, elastic):
    solver.reset()
    found = solver.solve(PLACE, fields=True)
    np.testing.assert_allclose(found.von_mises, elastic.von_mises, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(found.response, elastic.response, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found.response_gradient, elastic.response_gradient, rtol=1e-5, atol=1e-4)
    assert found.potential_energy == pytest.approx(elastic.potential_energy, rel=1e-7)
    assert found.strain_energy == pytest.approx(elastic.strain_energy, rel=1e-7)


@pytest.mark.full
def test_a_held_probe_feels_the_force_relax_to_the_slow_limit(solver, elastic):
    """From the instantaneous force down to that of the relaxed moduli, and no further."""
    solver.reset()
    times = np.array([1e-6, 0.5, 1.0, 2.0, 4.0, 80.0])
    forces = np.array([one.response[2] for one in solver.march(times, np.tile(PLACE, (6, 1)))])
    relaxed = problem(Viscoelastic(gel(), ((SHARE, TIME),)).relaxed_law()).solve(PLACE).response[2]
    assert (np.diff(forces) < 0).all()
    assert forces[0] == pytest.approx(elastic.response[2], rel=1e-5)
    assert forces[-1] == pytest.approx(relaxed, rel=1e-3)


@pytest.mark.full
def test_an_instant_leaves_the_history_alone(solver):
    def last(interlude):
        solver.reset()
        solver.solve(PLACE, dt=1.0)
        if interlude:
            solver.solve(above(0.001))
        return solver.solve(PLACE, dt=1.0).response

    after, alone = last(True), last(False)
    assert np.linalg.norm(after - alone) <= 1e-9 * np.linalg.norm(alone)


@pytest.mark.full
def test_a_failed_step_leaves_the_history_as_it_was(solver):
    def last(failing):
        solver.reset()
        solver.solve(PLACE, dt=1.0)
        if failing:
            assert not solver.solve((0.03, 0.03, -0.02), dt=1.0).converged
        return solver.solve(PLACE, dt=1.0).response

    after, alone = last(True), last(False)
    assert np.linalg.norm(after - alone) <= 1e-9 * np.linalg.norm(alone)


def test_time_goes_forward(solver):
    with pytest.raises(UsageError, match="ascend"):
        solver.march([1.0, 1.0], [PLACE, PLACE])
    with pytest.raises(UsageError):
        solver.solve(PLACE, dt=-1.0)
