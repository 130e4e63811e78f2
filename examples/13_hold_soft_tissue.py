"""A suction cup on soft tissue: few solves, one energy, and the force that a hand feels wherever the cup sits.

The pad is glued around a point of the top and displaced by up to 4 mm in every direction. Place and displacement are
inputs; the sweep knows the block's square symmetry, which makes eight solves of each.
"""

from itertools import pairwise

import numpy as np

import palpate as pp

tissue = pp.Body(
    pp.shapes.Block((0.06, 0.06, 0.03)), pp.materials.NeoHookean(young=9e3, poisson=0.45), fixed="bottom"
)
cup = pp.GluedPad(
    radius=0.012, over=((0.025, 0.025), (0.035, 0.035)), displacement=((-0.004, 0.004),) * 3, element=0.012
)
solves = pp.sweep(tissue, cup, samples=8, seed=0)

surrogate, history = pp.learn(solves, effort=0.1)
print(surrogate)
print(f"left-out force error: {100 * np.median(history.energy.errors):.2f} % median")

held = pp.load(surrogate.save("held.palpate")).energy.evaluator()
place = np.array([0.030, 0.028])
for lift in (0.0, 0.001, 0.002, 0.004):
    held(np.array([0.0, 0.0, lift]), place)
    print(
        f"lifted {1e3 * lift:.0f} mm: force {held.force[2]:8.4f} N, stiffness {-held.stiffness[2, 2]:6.1f} N/m"
    )

# with the cup at rest the force is zero, not small; and a closed path of the hand costs nothing
corners = np.array([[0.003, 0, 0], [0, 0.003, 0.002], [-0.002, 0, -0.003], [0.003, 0, 0]])
at, weight = np.polynomial.legendre.leggauss(256)  # enough for the narrowest unit a search finds
work = 0.0
for a, b in pairwise(corners):
    for t, w in zip(at, weight, strict=True):
        held(a + (t + 1) / 2 * (b - a), place)
        work += w / 2 * held.force @ (b - a)
held(corners[0], place)
print(f"work around a closed path: {abs(work) / held.energy:.1e} of the energy of its first corner")
