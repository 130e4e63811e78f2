"""Copper that stays bent: a cantilever loaded past yield, unloaded, and loaded again.

The section is cut into fibres that yield and harden; what they have been through decides the answer, so loads come in
an order. `solve_path` follows one history; a `LoadAndUnload` makes the history a pair of inputs for a sweep.
"""

import math

import palpate as pp
from palpate.physics.beam import LoadAndUnload
from palpate.physics.materials.hardening import LinearHardening
from palpate.physics.materials.plastic import Plastic

copper = pp.named_material("annealed copper")
rod = pp.Cantilever(length=1.0, section=pp.Circle(radius=0.005), material=copper)
first = copper.hardening.yield_stress * math.pi * 0.005**3 / 4
print(f"first yield at the clamp: {first:.2f} N at the tip")

problem = rod.problem(pp.TipLoad(0.0, 30.0))
print("  load    tip under load   after unloading   work kept or lost")
for load in (5.0, 10.0, 15.0, 20.0, 25.0):
    loaded, bare = problem.solve_path([load, 0.0])
    down, left = -1000 * loaded.displacement[-1, 1], -1000 * bare.displacement[-1, 1]
    print(f"{load:4.0f} N  {down:12.2f} mm  {left:12.2f} mm  {loaded.dissipated:12.4f} J")

# loading again goes back the way the unloading came, up to the highest load so far
once, bare, again, further = problem.solve_path([20.0, 0.0, 20.0, 25.0])
drift = abs(again.displacement - once.displacement).max()
print(f"to 20 N again: the same shape to {1e9 * drift:.0f} nm")
print(f"and on to 25 N: {-1000 * further.displacement[-1, 1]:.2f} mm")

# the same as a question with two inputs, for a sweep: the largest load so far and the load now
history = rod.problem(LoadAndUnload("P", peak=(0.0, 25.0)))
print("inputs:", ", ".join(str(given) for given in history.ranges))
print(f"20 N, then 5 N: {-1000 * history.solve((20.0, 5.0)).displacement[-1, 1]:.2f} mm")
print(f"       just 5 N: {-1000 * history.solve((5.0, 5.0)).displacement[-1, 1]:.2f} mm")

# without hardening there is a load, 4r³σ/3L, that no equilibrium bears
perfect = Plastic(copper.elastic, LinearHardening(yield_stress=90e6))
hinge = pp.Cantilever(length=1.0, section=pp.Circle(radius=0.005), material=perfect, kinematics="small")
collapse = 4 * 0.005**3 * 90e6 / 3
print(f"1.05 of the collapse load: {hinge.problem(pp.TipLoad(0.0, 30.0)).solve(1.05 * collapse).message}")
