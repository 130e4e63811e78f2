"""A beam of one's own: a silicone strip that sags under its weight and is pulled up in the middle.

Any material with a Young's modulus, any section with an area, a second moment and a shear factor.
"""

import palpate as pp

strip = pp.Cantilever(
    length=0.15,
    section=pp.Rectangle(width=0.02, height=0.006),
    material=pp.materials.LinearElastic(young=1.1e6, poisson=0.49, density=1080.0, name="silicone"),
    self_weight=True,
    nodes=(0.0, 0.05, 0.10, 0.15),
)
lift = pp.PointLoad("lift", at=0.10, low=0.0, high=0.25, direction=(0, 1))

rest = strip.problem(lift).solve(0.0)
print(f"sag at the tip under its own weight: {-1000 * rest.displacement[-1, 1]:.1f} mm")
print(f"the clamp carries {1000 * rest.root_reaction[1]:.1f} mN")

data = pp.sweep(strip, lift, samples=32, seed=0)
train, test = data.split(test=0.25, seed=1)
touch, _ = pp.learn(train, name="strip", passes=1)
print(touch)
print(pp.validate(touch, test))

too_much = strip.problem(lift).solve(500.0)
print(f"500 N: {too_much.message}")
