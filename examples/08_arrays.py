"""From arrays alone: a network, how far it may be off, and where it may be believed.

What is learnt is how far a mass on a hardening spring swings, from measurements with noise: force and damping in,
amplitude and phase out. Nothing is said but the arrays; form, size and settings are found.
"""

import numpy as np

import palpate as pp
from palpate.learning import Fitted


def measured(X, rng):
    """Amplitude and phase of a driven oscillator whose spring stiffens, with a noise of 0.01."""
    force, damping = X.T
    amplitude = force / np.sqrt((1 + force**2 - 0.8) ** 2 + (2 * damping) ** 2)
    phase = np.arctan2(2 * damping, 0.2 + force**2)
    return np.column_stack([amplitude, phase]) + 0.01 * rng.normal(size=(len(X), 2))


rng = np.random.default_rng(0)
low, high = [0.1, 0.1], [2.0, 0.6]
X = rng.uniform(low, high, (400, 2))
Y = measured(X, rng)

model = pp.fit(X, Y)
print(model)

X_new = rng.uniform(low, high, (2000, 2))
Y_new = measured(X_new, rng)
lower, upper = model.interval(X_new)
inside = (lower <= Y_new) & (Y_new <= upper)
error = np.sqrt(((model.predict(X_new) - Y_new) ** 2).mean(axis=0))
print(
    f"2000 new measurements: error {error[0]:.4f} and {error[1]:.4f}, {inside.mean():.1%} inside the intervals"
)

for x in [[1.0, 0.3], [6.0, 0.3]]:
    (value,), (width,), (trusted,) = model.predict([x]), model.deviation([x]), model.trusted([x])
    print(
        f"force {x[0]:.0f}: amplitude {value[0]:.3f} ± {width[0]:.3f}, {'trusted' if trusted else 'not trusted'}"
    )

model.save("oscillator.palpate")
again = Fitted.load("oscillator.palpate")
print(f"read back: the same answers: {(again.predict(X_new) == model.predict(X_new)).all()}")
