"""One query at a time, interleaved with rivals in the same process.

    python -m benchmarks.latency [--quick] [--json]

Every round times a block of calls of each contender, one after the other, so that whatever else the machine does
falls on all of them; figures are medians over the rounds, and ratios are taken within a round.
"""

from __future__ import annotations

import gc
import math
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.cantilever import refined
from benchmarks.cases import FEW, Case, case, touch_model
from benchmarks.marks import NUMPY, OURS, Contenders, Mark, marks
from benchmarks.rivals import RIVALS
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.network import Network, Scaling
from palpate.network.radial import radial
from palpate.runtime.touchable import touchable
from palpate.surrogates import NodeField, PadBaseline, Surrogate
from palpate.units import Quantity, Range

__all__ = ["NumpyNetwork", "interleaved", "tables"]

BLOCK = 3e-4  # s: far above the clock's resolution, and mostly between two interruptions


class NumpyNetwork:
    """A network of one input in plain NumPy, everything that can be done beforehand done beforehand.

    f(x) = c + d x + Σ_k w_k exp(−(a_k x − b_k)²), all scaling folded into a, b, c, d and w.
    """

    def __init__(self, network: Network) -> None:
        s = network.scaling
        centre, half = s.input_centre[0], s.input_half[0]
        self.a = network.factors[:, 0, 0] / half
        self.b = network.shifts[:, 0] + self.a * centre
        self.d = network.tail[:, 1] * s.output_scale / half
        self.c = network.tail[:, 0] * s.output_scale + s.output_centre - self.d * centre
        self.w = np.ascontiguousarray((network.weights * s.output_scale[:, None]).T)

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Outputs (m,) at x (1,)."""
        t = self.a * x[0] - self.b
        return self.c + self.d * x[0] + np.exp(-t * t) @ self.w


class NumpyTouch:
    """A tick's arithmetic for one load across the beam, in plain NumPy.

    Projection of the hand on the load's direction, U = ½ K w² exp ℓ(w) and its slope, the load that holds the node
    there, the mirror image of the shape, position of the held node, reaction.
    """

    def __init__(self, model: Surrogate) -> None:
        field, baseline, network = model.fields["displacement"], model.energy.baseline, model.energy.network
        assert isinstance(field, NodeField)
        assert isinstance(baseline, PadBaseline)
        s = network.scaling
        self.direction, self.stiffness = baseline.axes[0], float(baseline.rest.coefficients[0, 0]) ** 2
        self.factors, self.shifts = network.factors[:, 0, 0], network.shifts[:, 0]
        self.weights, self.tail, self.radial = network.weights[0], network.tail[0], network.radial
        self.scales = (s.input_centre[0], s.input_half[0], s.output_centre[0], s.output_scale[0])
        self.tip = NumpyNetwork(field.network)
        rows = slice(2 * field.held, 2 * field.held + 2)
        for name in ("c", "d"):
            setattr(self.tip, name, getattr(self.tip, name)[rows])
        self.tip.w = np.ascontiguousarray(self.tip.w[:, rows])
        self.hand, self.load = model.inputs[0], field.inputs[0]

    def __call__(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
        """Force (3,) on the hand, position (2,) of the held node, and whether this is inside the range."""
        w = float(self.direction @ position)
        centre, half, middle, scale = self.scales
        x = (w - centre) / half
        t = self.factors * x - self.shifts
        phi, slope, _ = radial(self.radial, t * t)
        value = middle + scale * (self.tail[0] + self.tail[1] * x + self.weights @ phi)
        rise = scale / half * (self.tail[1] + self.weights @ (2.0 * slope * t * self.factors))
        load = self.stiffness * math.exp(value) * (w + 0.5 * w * w * rise)
        contact = self.tip((min(abs(load), self.load.high),))
        if load < 0:
            contact = contact - 2 * (contact @ self.direction[:2]) * self.direction[:2]
        return -load * self.direction, contact, self.hand.low <= w <= self.hand.high


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` takes few rounds and a coarse sweep."""
    rounds = 20 if quick else 400
    c = case("nylon", 51 if quick else 501)
    real, _ = refined(c, FEW, 0)
    rows, claims = [], []
    queries = {
        "network, 10 units": _network_query(ten_units()),
        f"network, refined nylon, {real.units} units": _network_query(real) | _rivals(c),
        "tick of the refined nylon beam": _touch_query(touch_model("nylon", quick=quick)),
    }
    for mark in [*(Mark(query, contenders, 0.5) for query, contenders in queries.items()), *marks()]:
        spent = interleaved(mark.contenders, rounds)
        for name, seconds in spent.items():
            ratio = float(np.median(seconds / spent[OURS]))
            microseconds = 1e6 * float(np.median(seconds))
            rows.append({"query": mark.query, "who": name, "microseconds": microseconds, "ratio": ratio})
        share = float(np.median(spent[mark.measured] / spent[mark.rival]))
        claims.append(Claim(mark.claim, (share,), mark.bound, ".2f"))
    return [
        Table(
            "latency",
            f"One query, called from Python{quick_mark(quick)}",
            (
                Column("query", "query"),
                Column("who", "by"),
                Column("microseconds", "µs, median", ".1f"),
                Column("ratio", "over palpate's", ".1f"),
            ),
            rows,
            claims,
            (
                f"medians of {rounds} interleaved rounds; rivals learnt from the same {FEW} solves, and get "
                "their input scaled beforehand",
                "the first three have one input and five outputs, the others n → m",
                "tick: hand position in, force, load, held node's position and out-of-range flag out",
            ),
        )
    ]


def ten_units() -> Network:
    """A network of one input, five outputs and ten units; what it costs does not depend on its values."""
    rng = np.random.default_rng(0)
    return Network.axis_aligned(
        (Range("P", 0.0, 5.0, "N"),),
        tuple(Quantity(f"y{i}") for i in range(5)),
        centres=np.linspace(-1, 1, 10)[:, None],
        widths=np.full((10, 1), 0.3),
        weights=rng.normal(size=(5, 10)),
        tail=rng.normal(size=(5, 2)),
        scaling=Scaling(np.array([2.5]), np.array([2.5]), np.zeros(5), np.ones(5)),
    )


def _network_query(network: Network) -> dict[str, Callable[[], Any]]:
    evaluator, plain, x = network.evaluator(), NumpyNetwork(network), np.array([1.7])
    np.testing.assert_allclose(plain(x), evaluator(x), rtol=0, atol=1e-10)  # the same network indeed
    return {OURS: lambda: evaluator(x), NUMPY: lambda: plain(x)}


def _touch_query(model: Surrogate) -> dict[str, Callable[[], Any]]:
    body, plain, none = touchable(model), NumpyTouch(model), np.zeros(0)
    evaluator, position = body.evaluator(), 0.4 * body.reach * model.energy.baseline.directions[0]
    evaluator(position, none)
    force, contact, _ = plain(position)
    np.testing.assert_allclose(force, evaluator.force, rtol=0, atol=1e-9)
    np.testing.assert_allclose(contact, evaluator.contact[:2], rtol=0, atol=1e-9)
    return {OURS: lambda: evaluator(position, none), NUMPY: lambda: plain(position)}


def _rivals(c: Case) -> dict[str, Callable[[], Any]]:
    X, Y = c.few()
    x, query = X[:, 0] / 2.5 - 1, np.array([1.7 / 2.5 - 1])
    size = float(np.abs(Y).max())
    wanted = {name: fit for name, fit in RIVALS.items() if not name.startswith(("Chebyshev", "quintic"))}
    fitted = {name: fit(x, Y / size) for name, fit in wanted.items()}
    return {name: lambda p=predictor: p(query) for name, predictor in fitted.items()}


def interleaved(contenders: Contenders, rounds: int) -> dict[str, np.ndarray]:
    """Seconds per call (rounds,) of each contender, timed block by block in turn."""
    calls = {name: max(1, math.ceil(BLOCK / _once(call))) for name, call in contenders.items()}
    spent: dict[str, list[float]] = {name: [] for name in contenders}
    gc.disable()  # as `timeit` does
    try:
        for _ in range(rounds):
            for name, call in contenders.items():
                spent[name].append(_block(call, calls[name]))
    finally:
        gc.enable()
    return {name: np.array(seconds) for name, seconds in spent.items()}


def _once(call: Callable[[], Any]) -> float:
    """Rough cost of one warm call, s."""
    for _ in range(3):
        call()
    return min(_block(call, 5) for _ in range(3))


def _block(call: Callable[[], Any], count: int) -> float:
    began = time.perf_counter()
    for _ in range(count):
        call()
    return (time.perf_counter() - began) / count


if __name__ == "__main__":
    sys.exit(main(only="latency"))
