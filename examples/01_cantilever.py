"""A nylon cantilever, from finite elements to the fingertip.

Sixty-four loads are solved, a network learns three quarters of them and is checked against the rest. In a
terminal the page is served at the end; Ctrl-C ends it.
"""

import sys

import palpate as pp

beam = pp.Cantilever(length=1.0, section=pp.Circle(radius=0.005), material=pp.named_material("nylon"))
loads = pp.TipLoad(0.0, 5.0)
data = pp.sweep(beam, loads, samples=64, seed=0)
train, test = data.split(test=0.25, seed=1)
touch, history = pp.learn(train)
validation = pp.validate(touch, test)
validation.raise_if_failed()
touch.save("beam.palpate")

print(data)
print(touch)
print(validation)

if sys.stdout.isatty():
    print("http://127.0.0.1:8080, or the next port where that one is busy")
    pp.serve(touch, open_browser=True)
