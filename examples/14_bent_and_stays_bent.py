"""A copper rod that a hand bends past yield: learnt from a few histories, touched step by step, and it stays bent.

Each history is a march of finite elements from the virgin rod. The rod without its memory, its elastic twin, gives the
coordinate in which springs that slip add up to its force.
"""

from dataclasses import replace

import numpy as np

import palpate as pp
from palpate.learning.plastic import lead_held, lead_twin, learn_held

copper = pp.named_material("annealed copper")
rod = pp.Cantilever(
    length=1.0, section=pp.Circle(radius=0.005), material=copper, elements=8, fibres=24, tolerance=1e-4
)
bent = rod.problem(pp.TipLoad(-25.0, 25.0))
train = lead_held(bent, low=-25.0, high=25.0, count=3, seed=1)
test = lead_held(bent, low=-25.0, high=25.0, count=2, seed=1001, outward=0.0)
reach = max(abs(path.place).max() for path in (*train.paths, *test.paths))
elastic = replace(rod, material=copper.elastic, fibres=None, tolerance=None)
twin = lead_twin(elastic.problem(pp.TipLoad(0.0, 60.0)), reach=reach, load=30.0)

body, fit = learn_held(train, twin, name="copper rod")
print(body)
print(fit)

miss, elastic_miss = [], []
for path in test.paths:
    force, stored, lost = body.follow(path.place)
    h, slope = body.stretches(path.place)
    miss.append(force - path.force)
    elastic_miss.append(body.elements.total * h * slope - path.force)
for name, error in (("with a memory", miss), ("elastic only", elastic_miss)):
    median, p95 = np.percentile(np.abs(np.concatenate(error)) / 25.0, [50, 95])
    print(f"unseen histories, {name}: force error {median:.2%} median, {p95:.2%} p95 of 25 N")

# a hand at 1 kHz: down to 20 cm within 0.5 s, let go, and pick it up where it stayed
hand, down = body.evaluator(), np.array([0.0, -1.0, 0.0])
for w in np.linspace(0.0, 0.20, 500):
    hand(w * down)
print(f"held at 200 mm: {-hand.force @ down:.2f} N, stored {hand.stored:.3f} J, lost {hand.lost:.3f} J")
hand.release()
print(f"let go: it stays at {1000 * hand.loads[0]:.0f} mm")
body.save("copper-rod.palpate")
