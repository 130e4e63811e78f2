"""A law that was stretched before it was built in."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from scipy.optimize import brentq

from palpate.errors import UsageError
from palpate.physics.materials import (
    LinearElastic,
    NeoHookean,
    Ogden,
    PreStretched,
    PronySeries,
    Viscoelastic,
)
from palpate.physics.materials.tensors import gradient

BASE = NeoHookean(9e3, 0.4)
RNG = np.random.default_rng(0)
F = np.eye(3) + RNG.uniform(-0.1, 0.1, (20, 3, 3))


def test_its_thickness_is_where_a_free_face_has_no_stress():
    """Coupled neo-Hooke: μ (λ_z² − 1) + λ ln(λ_x λ_y λ_z) = 0."""
    mu, lame = BASE.shear_modulus, BASE.bulk_modulus - 2 / 3 * BASE.shear_modulus
    x, y, z = PreStretched(BASE, 1.2, 1.1).stretches
    assert (x, y) == (1.2, 1.1)
    by_hand = brentq(lambda s: mu * (s**2 - 1) + lame * math.log(1.2 * 1.1 * s), 0.5, 1.0)
    assert z == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("base", [BASE, Ogden.with_poisson(0.45, mu=(3e3,), alpha=(2.5,))])
def test_at_rest_it_has_the_true_stress_of_the_stretched_base(base):
    law = PreStretched(base, 1.15, 0.95)
    before = np.diag(law.stretches)[None]
    P = gradient(base.energy, before)[0]
    stress = P @ before[0].T / np.linalg.det(before[0])
    at_rest = gradient(law.energy, np.eye(3)[None])[0]
    np.testing.assert_allclose(at_rest, stress, atol=1e-9 * base.young)
    assert abs(at_rest[2, 2]) < 1e-8 * base.young
    assert at_rest[0, 0] > 0


def test_its_energy_is_the_bases_beyond_the_stretch_by_volume_of_the_drawn_shape():
    law = PreStretched(BASE, 1.2)
    before = np.diag(law.stretches)
    expected = (BASE.energy(F @ before) - BASE.energy(before[None])) / np.prod(law.stretches)
    np.testing.assert_allclose(law.energy(F), expected, rtol=1e-12)
    np.testing.assert_allclose(PreStretched(BASE, 1.0).energy(F), BASE.energy(F), rtol=1e-12, atol=1e-9)


def test_it_is_a_value():
    law = PreStretched(BASE, 1.2)
    assert pickle.loads(pickle.dumps(law)) == law
    assert hash(law) == hash(PreStretched(BASE, 1.2))
    assert law.describe() == {
        "law": "PreStretched", "base": BASE.describe(), "stretch_x": 1.2, "stretch_y": None,
    }  # fmt: skip
    assert "stretched by 1.2 and 1.2" in str(law)


@pytest.mark.parametrize(
    "base",
    [
        LinearElastic(9e3, 0.3),
        NeoHookean(9e3, 0.5, form="isochoric"),
        Viscoelastic(BASE, PronySeries(((0.3, 0.1),))),
    ],
)
def test_other_laws_can_not_be_stretched_beforehand(base):
    with pytest.raises(UsageError, match="stretched beforehand"):
        PreStretched(base, 1.1)


def test_a_stretch_is_positive():
    with pytest.raises(UsageError, match="stretch along y"):
        PreStretched(BASE, 1.1, -1.0)
