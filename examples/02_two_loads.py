"""The tip pushed in the plane: two loads, two displacements, and a virtual coupling between hand and tip.

A slender beam hardly stretches, so near the straight state the axial force is no function of where the tip is.
`learn` therefore puts a spring between hand and tip, and says how stiff it is.
"""

import numpy as np

import palpate as pp

beam = pp.Cantilever(length=1.0, section=pp.Circle(radius=0.005), material=pp.named_material("nylon"))
loads = [
    pp.TipLoad(-0.5, 0.5, direction=(1, 0), name="P_x"),
    pp.TipLoad(-1.0, 1.0, direction=(0, 1), name="P_y"),
]
data = pp.sweep(beam, loads, samples=96, seed=0)
train, test = data.split(test=0.25, seed=1)
touch, _ = pp.learn(
    train, passes=1, refinement=pp.Refinement(samples=72, units_max=11, target=1e-5, starts=1)
)

print(touch)
print(f"virtual coupling: {1 / touch.energy.baseline.compliance:.0f} N/m")

hands = np.array([(0.0, -0.2), (0.02, -0.2), (0.3, -0.2)])  # m, along the two loads
force, inside = touch.energy.force(hands), touch.energy.inside(hands)
loads = -force @ touch.energy.baseline.directions.T  # what the hand pulls with
tips = touch.fields["displacement"].values(loads)[:, -1]
for (x, y), F, tip, good in zip(hands, force, tips, inside, strict=True):
    print(
        f"hand at ({x:+.2f}, {y:+.2f}) m: force on it ({F[0]:+.2f}, {F[1]:+.2f}) N, "
        f"tip at ({tip[0]:+.3f}, {tip[1]:+.3f}) m, {'inside' if good else 'outside'} the trained range"
    )

print(pp.validate(touch, test))
