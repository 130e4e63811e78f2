"""A process that fetches and evaluates as fast as it can until it holds network number `last`.

    python reader.py NAME LAST

Every network n of the publisher has output j at x0 equal to n + j, and numbers 1 … n in its shape; one JSON line
says how many were fetched, how many were refused while being written, and the largest deviation.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from palpate.network import Subscriber

X0 = np.array([0.3, -0.2, 0.7])


def main(name: str, last: int) -> None:
    until, fetched, worst, backwards, before = time.monotonic() + 60, 0, 0.0, 0, 0
    with Subscriber.attach(name, jacobian=True) as subscriber:
        while not subscriber.fetch():  # the first costs loading what is compiled
            time.sleep(0.01)
        subscriber(X0)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        while subscriber.serial < last and time.monotonic() < until:
            if not subscriber.fetch():
                continue
            fetched += 1
            backwards += subscriber.serial <= before
            before = subscriber.serial
            y = subscriber(X0)
            worst = max(worst, float(np.abs(y - before - np.arange(y.size)).max()))
            worst = max(worst, abs(float(subscriber.network.predict(X0[None])[0, 0]) - before))
    json.dump({"fetched": fetched, "worst": worst, "backwards": backwards, "serial": before}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
