"""Fibres: tension only, dispersion, any matrix."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.physics.materials import FibreFamily, FibreReinforced, NeoHookean, Ogden
from palpate.physics.materials.tensors import gradient

SOFT = NeoHookean.from_shear(2e3, poisson=0.49, form="isochoric")


def test_a_direction_is_normalised():
    assert FibreFamily((0, 3, 4), 1e3, 1.0).direction == (0.0, 0.6, 0.8)


def test_shortened_fibres_bear_nothing():
    law = FibreReinforced(SOFT, FibreFamily((1, 0, 0), 1e6, 10.0))
    short = np.diag([0.9, 0.9**-0.5, 0.9**-0.5])
    np.testing.assert_allclose(gradient(law.energy, short), gradient(SOFT.energy, short), rtol=1e-12)
    assert law.energy(np.linalg.inv(short)) > SOFT.energy(np.linalg.inv(short))


def test_energy_and_stress_are_continuous_where_fibres_engage():
    fibres = FibreFamily((1, 0, 0), 1e4, 5.0, 0.2)
    shear = np.linspace(-0.3, 0.3, 6001)
    F = np.tile(np.eye(3), (len(shear), 1, 1))
    F[:, 0, 0], F[:, 1, 1], F[:, 0, 1] = 1 + shear, 1 / (1 + shear), 0.1
    stress = gradient(fibres.energy, F)
    assert np.abs(np.diff(stress, axis=0)).max() < 20 * np.abs(stress).max() * (shear[1] - shear[0])
    assert (fibres.energy(F) == 0).any()
    assert (fibres.energy(F) > 0).any()


def test_fully_dispersed_fibres_have_no_direction():
    one, other = (FibreFamily(d, 1e4, 2.0, 1 / 3) for d in ((1, 0, 0), (0, 1, 1)))
    F = np.eye(3) + 0.3 * np.random.default_rng(1).normal(size=(5, 3, 3))
    np.testing.assert_allclose(one.energy(F), other.energy(F), rtol=1e-12)


@pytest.mark.parametrize(
    "matrix", [NeoHookean(5e3, 0.3), NeoHookean(5e3, 0.0), Ogden(2e3, 3.0, 1e5)], ids=str
)
def test_any_large_strain_law_is_a_matrix(matrix):
    families = (FibreFamily((1, 0, 0), 1e3, 1.0), FibreFamily((0, 1, 0), 1e3, 1.0))
    law = FibreReinforced(matrix, families, name="tissue")
    F = np.diag([1.2, 1.1, 0.9])
    added = sum(f.energy(F) for f in families)
    assert law.energy(F) == pytest.approx(matrix.energy(F) + added)
    assert law.young == pytest.approx(matrix.young)
    assert law.density == matrix.density
    assert law.stored_energy(F, {}) == pytest.approx(law.energy(F))
    assert law.dissipated_energy(F, {}, 1.0) == 0.0
