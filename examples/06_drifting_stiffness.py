"""A cantilever softens by 30 % while it is being learnt, and the network follows.

Every observation is a finite-element solve of a nylon rod under a tip load. Young's modulus E falls as time goes by;
a linear elastic rod without weight depends on P/E alone, so the softened rod is the rod under P·E₀/E.

Three networks see the same stream: one lets its parameters wander (process noise), one takes them for constant, one
is frozen before the drift begins. Meanwhile another process evaluates the newest snapshot of the first.
`--picture drift.png` draws it.
"""

import argparse
import multiprocessing
import time
from dataclasses import replace

import numpy as np

from palpate.learning import default
from palpate.learning.stream.learner import Learner
from palpate.network import Publisher, Subscriber
from palpate.physics.beam.beam_presets import preset
from palpate.units import Range

BEGIN, END, STOP = 250, 600, 700  # observations: drift begins, drift ends, stream ends


def stiffness(t):
    """E/E₀ at the t-th observation."""
    return 1.0 - 0.3 * np.clip((t - BEGIN) / (END - BEGIN), 0.0, 1.0)


def read(name, stop, answer):
    """What the other process does: evaluate at 2.5 N, always with the newest network."""
    x, evaluations, seen = np.array([2.5]), 0, []
    with Subscriber.attach(name) as subscriber:
        while not stop.is_set():
            if subscriber.fetch():
                seen.append(subscriber.serial)
            if seen:
                tip = float(subscriber(x)[-1])
                evaluations += 1
            time.sleep(0.001)
        subscriber.fetch()
        tip = float(subscriber(x)[-1])
    answer.send((evaluations, len(seen), seen == sorted(set(seen)), tip))


def main(picture=None):
    problem = preset("beam-nylon").problem()
    solver = problem.open()
    nodes = [int(i) for i in np.flatnonzero(problem.of_interest) if problem.rest[i, 0] > 0]

    def deflections(load, t):
        return solver.solve(np.array([load / stiffness(t)])).displacement[nodes, 1]

    outputs = [Range(f"u_y at {problem.rest[i, 0]:g} m", -1.0, 0.0, "m") for i in nodes]
    # what was learnt does not stay true, so nothing may forbid to unlearn it
    wandering = replace(default(), process_noise=1e-3, regression_limit=0.0)
    following = Learner(problem.ranges, outputs, settings=wandering, refining=None)
    constant = Learner(problem.ranges, outputs, settings=default(), refining=None)

    grid = np.linspace(0.25, 4.75, 10)
    loads = np.random.default_rng(0).uniform(0.0, 5.0, STOP)
    frozen, rows = None, []
    spawn = multiprocessing.get_context("spawn")
    stop, (mine, theirs) = spawn.Event(), spawn.Pipe(duplex=False)
    with Publisher.create(problem.ranges, following.outputs, units=wandering.units_max) as publisher:
        reader = spawn.Process(target=read, args=(publisher.name, stop, theirs))
        reader.start()
        for t, load in enumerate(loads, start=1):
            u = deflections(load, t)
            following.observe(np.array([load]), u)
            constant.observe(np.array([load]), u)
            following.publish(publisher)
            if t == BEGIN:
                frozen = following.network
            if t % 50 == 0 and t >= BEGIN:
                truth = np.array([deflections(p, t) for p in grid])
                networks = (following.network, constant.network, frozen)
                errors = [np.sqrt(((n.predict(grid[:, None]) - truth) ** 2).mean()) for n in networks]
                rows.append((t, stiffness(t), *errors))
                print(
                    f"{t:4d} observations, stiffness {100 * stiffness(t):3.0f} %, RMS error in mm: "
                    "following {:.2f}, constant {:.2f}, frozen {:.2f}".format(*(1000 * e for e in errors))
                )
        stop.set()
        evaluations, networks, ordered, tip = mine.recv()
        reader.join()
    own = following.network.predict(np.array([[2.5]]))[0, -1]
    print(f"the reader evaluated {evaluations} times with {networks} networks, in order: {ordered}")
    print(f"tip at 2.5 N: {1000 * tip:.6f} mm in the reader, {1000 * own:.6f} mm here")
    if picture:
        draw(np.array(rows), picture)


def draw(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    fig, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for k, label in enumerate(("following", "constant", "frozen")):
        axes.semilogy(rows[:, 0], 1000 * rows[:, 2 + k], marker="o", label=label)
    axes.axvspan(BEGIN, END, color="0.92", label="stiffness falls by 30 %")
    axes.set(xlabel="observations", ylabel="RMS error in mm")
    axes.legend()
    fig.savefig(path, dpi=150)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--picture", metavar="FILE")
    main(parser.parse_args().picture)
