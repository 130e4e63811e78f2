"""The sequential filter, one observation at a time: `step(state, x, y) -> (state, event)`.

A function of one input is learnt from noisy samples. Each line of stars is an observation after which the network
had another size; a star is a unit.
"""

import numpy as np

from palpate.learning import Settings, initial, step
from palpate.rbf.filter.prediction import value

settings = Settings(
    error_min=0.05,
    error_rms_min=0.03,
    distance_min=0.1,
    noise=1e-4,
    regression_limit=2.0,
    prune_below=0.1,
    prune_after=20,
)
rng = np.random.default_rng(2)


def truth(x):
    return np.tanh(4 * x) + 0.3 * np.sin(6 * x)


state = initial(inputs=1, outputs=1, settings=settings)
for t in range(400):
    x = rng.uniform(-1, 1, 1)
    state, event = step(state, x, truth(x) + 0.01 * rng.normal(size=1), settings)
    if event.grew or event.pruned:
        what = "grew  " if event.grew else "pruned"
        print(f"{t:4d}  {what} at x = {x[0]:+.2f}, error {event.error:.2f}  {'*' * event.units}")

grid = np.linspace(-1, 1, 201)[:, None]
rms = np.sqrt(((value(state, grid, settings) - truth(grid)) ** 2).mean())
print(f"{state.units} units, RMS error {rms:.3f}")
for unit, centre, width in zip(state.weights, state.centres(settings), state.widths(settings), strict=True):
    print(f"  centre {centre[0]:+.2f}  width {width[0]:.2f}  weight {unit[0]:+.2f}")
