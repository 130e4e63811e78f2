"""A copper rod that a hand bends past yield: learnt from a few histories, touched step by step, and it stays bent.

Each history is a march of finite elements from the virgin rod. The rod without its memory gives the elastic energy,
along whose amplitude springs that slip add up to the force.
"""

from dataclasses import replace

import numpy as np

import palpate as pp
from palpate.dataset import histories_of
from palpate.sweeps import solve_histories

copper = pp.named_material("annealed copper")
rod = pp.Cantilever(
    length=1.0, section=pp.Circle(radius=0.005), material=copper, elements=8, fibres=24, tolerance=1e-4
)
elastic = replace(rod, material=copper.elastic, fibres=None, tolerance=None)
bent = rod.problem(pp.TipLoad(-25.0, 25.0))
train = solve_histories(bent, elastic=elastic.problem(pp.TipLoad(0.0, 60.0)), count=3, seed=1)
test = histories_of(solve_histories(bent, count=2, seed=1001, outward=0.0))

body, history = pp.learn(train, name="copper rod")
print(body)
print(history.memory)

miss, elastic_miss, down = [], [], body.energy.baseline.directions[0]
for path in test:
    places = path.place[:, None]
    miss.append(-body.follow(places).force @ down - path.force)
    elastic_miss.append(-body.energy.force(places) @ down - path.force)
for name, error in (("with a memory", miss), ("elastic only", elastic_miss)):
    median, p95 = np.percentile(np.abs(np.concatenate(error)) / 25.0, [50, 95])
    print(f"unseen histories, {name}: force error {median:.2%} median, {p95:.2%} p95 of 25 N")

# down to 20 cm, and let go there
led = body.follow(np.linspace(0.0, 0.20, 500)[:, None])
print(
    f"held at 200 mm: {-led.force[-1] @ down:.2f} N, stored {led.stored[-1]:.3f} J, lost {led.lost[-1]:.3f} J"
)
print(f"let go: it stays at {1000 * led.rest @ down:.0f} mm")
body.save("copper-rod.palpate")
