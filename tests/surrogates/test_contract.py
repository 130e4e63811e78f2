"""The checklist of `surrogate_checks.py` on every baseline and every memory that palpate registers."""

from __future__ import annotations

import numpy as np
import pytest
from surrogate_checks import CHECKS, Example
from test_pad_energy import made as pad_energy
from touch_made import around_points, touch_energy, undisturbed

import palpate as pp
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import ConstantBaseline, LearntEnergy, Surrogate
from palpate.surrogates.baselines import registered_baselines


def contact() -> Example:
    """A sphere on a plane; derivatives of its distance jump at the nodes of a table."""
    energy = touch_energy()
    rest = around_points(100)
    rest[:, 2] += 0.03
    return Example(Surrogate(energy), rest, undisturbed(energy, around_points(1500), 1e-4))


def pad() -> Example:
    """A glued pad on a face, displaced in all directions."""
    rest = np.zeros((20, 5))
    rest[:, 3:] = np.random.default_rng(0).uniform(-0.02, 0.02, (20, 2))
    return Example(Surrogate(pad_energy()), rest)


def constant() -> Example:
    """A node that is held through a spring and moves in a plane, of one unit: ℓ = 1 − exp(−‖ξ‖²), zero at rest."""
    inputs = [pp.Range(name, -0.02, 0.02, "m") for name in ("h_x", "h_y")]
    network = Network(
        tuple(inputs),
        (pp.Quantity("ln U/U0"),),
        factors=np.eye(2)[None],
        shifts=np.zeros((1, 2)),
        weights=np.array([[-1.0]]),
        tail=np.array([[1.0, 0.0, 0.0]]),
        scaling=Scaling(np.zeros(2), np.full(2, 0.02), np.zeros(1), np.ones(1)),
    )
    region = TrainedRegion.of(np.random.default_rng(1).uniform(-1.0, 1.0, (200, 2)))
    baseline = ConstantBaseline(0.05, np.eye(3)[:2])
    return Example(Surrogate(LearntEnergy(network, baseline, region=region)), np.zeros((1, 2)))


EXAMPLES = {"contact": contact, "pad": pad, "constant": constant}
OURS = [cls.name for cls in registered_baselines() if cls.__module__.startswith("palpate.")]


@pytest.mark.parametrize("name", OURS)
@pytest.mark.parametrize("check", CHECKS, ids=[check.__name__ for check in CHECKS])
def test_every_baseline_passes_the_checklist(name, check, tmp_path):
    assert name in EXAMPLES, f"give an example of the baseline {name!r}"
    check(EXAMPLES[name](), tmp_path)
