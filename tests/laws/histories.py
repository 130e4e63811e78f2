"""Histories of homogeneous states, and closed forms of bodies with a history."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.physics.materials.material import initial_state
from palpate.physics.materials.tensors import gradient


def rotation(vector):
    """The rotation matrix of a rotation vector (3,) in rad."""
    return Rotation.from_rotvec(vector).as_matrix()


def march(material, F, dt):
    """Take a material along F (step, 3, 3), dt seconds apart, from rest at F[0].

    Returns states {name: (step, ...)}, P (step, 3, 3) in Pa, heat (step,) in J/m³ and stored energy (step,).
    """
    state = initial_state(material, F[0])
    states, stresses, heats, stored = [], [], [], []
    for i, now in enumerate(F):
        step = None if i == 0 else dt
        stresses.append(gradient(lambda A, s=state, d=step: material.energy(A, s, d), now))
        heats.append(0.0 if i == 0 else float(material.dissipated_energy(now, state, dt)))
        state = material.advance(now, state, step)
        states.append(state)
        stored.append(float(material.stored_energy(now, state)))
    columns = {name: np.stack([s[name] for s in states]) for name in state}
    return columns, np.stack(stresses), np.array(heats), np.array(stored)


def tube_limit_pressure(inner, outer, yield_stress):
    """Pressure in Pa at which a perfectly plastic tube, closed or in plane strain, flows: 2k ln(b/a), k = σ_y/√3.

    Hill 1950, The Mathematical Theory of Plasticity, ch. V; von Mises' rule, incompressible flow.
    """
    return 2 * yield_stress / math.sqrt(3) * math.log(outer / inner)


def tube_first_yield_pressure(inner, outer, yield_stress):
    """Pressure in Pa at which the bore of a closed tube begins to flow: k (1 − a²/b²), any Poisson's ratio.

    Lamé's stresses have the deviator of pure shear when the axial stress is the mean of hoop and radial stress.
    """
    return yield_stress / math.sqrt(3) * (1 - (inner / outer) ** 2)


def tube_plastic_front(inner, outer, yield_stress, pressure):
    """Radius in m of the elastic-plastic front: p/k = 2 ln(c/a) + 1 − c²/b² (Hill 1950, ch. V)."""
    shear = yield_stress / math.sqrt(3)

    def surplus(front):
        return 2 * math.log(front / inner) + 1 - (front / outer) ** 2 - pressure / shear

    from scipy.optimize import brentq

    return brentq(surplus, inner, outer)
