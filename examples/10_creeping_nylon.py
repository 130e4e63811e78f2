"""Nylon that creeps: a cantilever under a load that is put on, held and taken off.

The elastic constants are those of the founding case; how it relaxes is made up (nylon's creep depends on its kind,
moisture and temperature).
"""

import palpate as pp
from palpate.physics.beam import preset

rod = preset("beam-viscoelastic").body
problem = rod.problem(pp.TipLoad(0.0, 5.0))

# a load that jumps is two loads at the same time
times = [0.0, 0.1, 1.0, 10.0, 10.0, 11.0, 30.0]
loads = [3.0, 3.0, 3.0, 3.0, 0.0, 0.0, 0.0]
print("   time   load        tip      stored   dissipated")
for state, load in zip(problem.solve_path(loads, times), loads, strict=True):
    tip = -1000 * state.displacement[-1, 1]
    print(
        f"{state.time:5.1f} s  {load:.0f} N  {tip:8.2f} mm  {state.strain_energy:.4f} J  {state.dissipated:.4f} J"
    )

# at first it is the elastic beam of the instantaneous modulus, in the end that of the relaxed one
for what, share in (("at once", 1.0), ("in the end", rod.material.prony.equilibrium)):
    elastic = pp.materials.LinearElastic(share * rod.material.young, rod.material.poisson)
    solution = pp.Cantilever(rod.length, rod.section, elastic).problem(pp.TipLoad(0.0, 5.0)).solve(3.0)
    print(f"elastic with the modulus {what}: {-1000 * solution.displacement[-1, 1]:.2f} mm")

# a slow load gives the beam time to creep, a fast one does not
for seconds in (0.01, 0.3, 10.0):
    ramp = problem.solve_path([3.0], times=[seconds])[0]
    print(f"3 N within {seconds:g} s: {-1000 * ramp.displacement[-1, 1]:.2f} mm")
