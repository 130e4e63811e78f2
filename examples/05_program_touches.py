"""A program in the place of a hand: one evaluation at a time, then the 1 kHz loop with a scripted stroke."""

import time

import numpy as np

import palpate as pp
from palpate.runtime import LoopProcess

beam = pp.Cantilever(length=1.0, section=pp.Circle(radius=0.005), material=pp.named_material("copper"))
data = pp.sweep(beam, pp.TipLoad(0.0, 5.0), samples=32, seed=0)
touch, _ = pp.learn(data, name="copper", passes=1)
path = touch.save("copper.palpate")

answer = touch.energy.evaluator()  # allocates nothing per call: what the loop uses
for millimetres in (-5, -10, -20, 20, -60):
    answer(np.array([0.0, millimetres / 1000, 0.0]), np.zeros(0))
    edge = "" if answer.inside else " (beyond the trained range)"
    print(f"tip at {millimetres:+4d} mm: {answer.force[1]:+.3f} N on the hand{edge}")

with LoopProcess(path, device="stroke:amplitude=0.05,frequency=2") as loop:
    for _ in range(5):
        time.sleep(0.3)
        state = loop.read()
        print(f"tick {state.tick:5d}: hand {1000 * state.hand[1]:+6.1f} mm, force {state.force[1]:+.3f} N")
print(loop.report())
