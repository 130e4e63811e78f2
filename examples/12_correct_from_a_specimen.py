"""A learnt body follows a specimen that is not quite the body it was learnt from.

The model is learnt from energies of a formula, in place of finite elements. The specimen is 1.4 times as stiff, has a
stiffer layer below 6 mm and lies 0.3 mm higher; a sensor measures forces on it with 5 mN of noise and 1 %.
"""

import numpy as np

from palpate.learning.correction import Corrector, Phantom, force_error
from palpate.learning.energy import learn_energy
from palpate.surrogates import ContactBaseline, ContactLaw, Solves, Surrogate, TouchedSurface
from palpate.units import Range

SIDE, R = 0.04, 0.010
LAW = ContactLaw("series", 1e-3)


def factor(c):
    """ln U/U₀ of the model's body: softer towards the edges, stiffer with depth; for complex numbers too."""
    x, y, z = ((c - [SIDE / 2, SIDE / 2, 0.004]) / [SIDE / 2, SIDE / 2, 0.006]).T
    return 11.0 - 0.2 * (x**2 + y**2) - 0.3 * z


def energy(c):
    s = R - c[:, 2]
    return s**3 / np.sqrt(1 + s / LAW.length) * np.exp(factor(c))


def touches(count, rng):
    return rng.uniform([0, 0, -0.002], [SIDE, SIDE, R - 2e-4], (count, 3))


rng = np.random.default_rng(0)
X = touches(40, rng)
F = np.stack([-energy(X + 1e-30j * e).imag / 1e-30 for e in np.eye(3)], axis=1)  # complex step
corners = SIDE * np.array([[-1, -1, 0], [2, -1, 0], [2, 2, 0], [-1, 2, 0]])
surface = TouchedSurface.of(corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=R)
inputs = (Range("x", 0, SIDE, "m"), Range("y", 0, SIDE, "m"), Range("z", -0.002, R, "m"))
solves = Solves(X, energy(X), F, None, inputs)
model, _ = learn_energy(solves, ContactBaseline(LAW, surface, R), choose=False, units_max=12, effort=0.2)

specimen = Phantom(model, factor=1.4, layer=0.3, depth=0.006, height=3e-4)
unseen = touches(1000, rng)
true = specimen.force(unseen)
print(f"the model:        {force_error(model, unseen, true)}")

corrector, count = Corrector(Surrogate(model)), 0
for more in (3, 10, 30, 100, 300):
    X = touches(more - count, rng)
    for position, force in zip(X, specimen.measured(X, 0.005, rng, 0.01), strict=True):
        corrector.observe(position, force)
    count, corrected = more, corrector.surrogate
    sure = np.median(corrected.energy.deviation(unseen))
    print(f"{count:4} measurements: {force_error(corrected.energy, unseen, true)}; says {100 * sure:.2g} %")

height, sure = corrector.offset
print(f"the specimen's surface lies {1e3 * height:+.2f} ± {1e3 * sure:.2f} mm over the model's")
corrected.save("specimen.palpate")
