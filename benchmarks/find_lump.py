"""A lump found by an ideal observer with a hand's limits, who decides by a learnt body; the truth is finite elements.

python -m benchmarks --only find_lump [--quick] [--json] [--record]
python -m benchmarks.find_lump docs/images/find-lump.svg    draws the record

The body is a block of prostatic tissue that holds ⌀15 mm under 10 mm. The observer presses it 30 times, each press with
a force noise of 7 % (10 % below 1 N) and 1 mm of doubt where along the surface it was, which the slope of the force
turns into noise. The observer knows the body without a lump, and by the learnt contrast what each of several hundred
lumps that might be there would change. Each press is the one that is expected to tell most, under the posterior over no
lump and all lumps; a place may be pressed again. A lump is said to be there where the mean likelihood of all lumps,
over that of none, is above a threshold that 5 % of simulated examinations without a lump exceed.
The pressed body is solved with its lump in each of a grid of presses; the same grid is offered to the observer.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.records import Record
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.errors import SolverError
from palpate.learning.lumps.learn_lumps import LEAST_CONTRAST
from palpate.physics.materials.tissues import TISSUES
from palpate.surrogates import Surrogate

__all__ = ["Observer", "block", "tables"]

PRESSED, DEPTHS = 44, 2  # presses that the body is learnt from, and their depths at each place
DEPTH = 0.0085  # m, of every press of an examination: the fingertip is pressed with more than 1 N
LATTICE = (5, 5)  # places along x and y, over the box that is touched
MOST, FEW = 30, 12  # presses of an examination, and to locate a lump that is there
FALSE_ALARMS = 0.05
STRONG, FAINT, LIGHT = 0.07, 0.10, 1.0  # relative noise from 1 N on and below, N
ASTRAY = 0.001  # m along the surface
EXAMINATIONS = 400
HIDDEN = 40  # places of a lump that is to be located
COVER = 0.010  # m of tissue over a lump
HARD = 10.0  # modulus of the hidden lump over the tissue's
PUBLISHED = ((10.0, 0.78), (3.0, 0.38))  # mm and share that people found
SIZES = (15.0, 12.0, 10.0, 8.0, 5.0, 3.0)  # diameters in mm
MIDDLE = (0.028, 0.028)  # m: the lumps of finite elements lie below it, as the block is pressed about it
BESIDE = (0.0252, 0.0308)  # m: further lumps of the learnt body lie below it, half-way between four presses
SOLVED = (15.0, 10.0)  # diameters in mm of the lumps of finite elements
RADII, SPACING = (0.004, 0.0055, 0.0075), 0.0045  # m, of the lumps that the observer thinks of


def block() -> pp.LumpProblem:
    """Return a block under a fingertip, with elements of 0.55 of its radius where it touches.

    With elements as large as the radius the force of four mirrored presses differs by some per cent with the mesh, and
    what a lump changes by a twelfth: no surrogate follows that.
    """
    body = pp.Body(pp.shapes.Block(size=(0.056, 0.056, 0.036), element=0.012), TISSUES["prostate"].material)
    finger = pp.SphereProbe(
        radius=0.009, touches="top", depth=(0.001, 0.009), over=((0.017, 0.017), (0.039, 0.039))
    )
    room = ((0.017, 0.017, 0.013), (0.039, 0.039, 0.023))
    return pp.LumpProblem(
        body.problem(finger, element=0.005), room, radius=(0.004, 0.008), element=0.0065, compliances=12
    )


def learnt_block(folder: Path, quick: bool) -> Surrogate:
    """Return the block learnt from its presses, which are solved unless the folder has them."""
    problem = block()
    points = problem.design(PRESSED, 1, depths=DEPTHS)[:: 4 if quick else 1]
    data = pp.sweep(problem, points=points, workers=1, path=folder / f"lumps-{len(points)}.zarr")
    return pp.learn(data, effort=0.1, workers=1)[0]


def lattice_of(problem: pp.LumpProblem) -> np.ndarray:
    """Return presses (P, 3) of one depth on a lattice over the touched box."""
    probe: Any = problem.base.interactions[0]
    (x0, y0), (x1, y1) = probe.over
    top = problem.base.body.geometry.size[2]  # type: ignore[attr-defined]  # it is a block
    axes = [np.linspace(low, high, n) for low, high, n in ((x0, x1, LATTICE[0]), (y0, y1, LATTICE[1]))]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.column_stack([places, np.full(len(places), top + probe.radius - DEPTH)])


def lumps_of(body: Surrogate, radii: Sequence[float], spacing: float) -> list[pp.Lump]:
    """Return hard lumps on a lattice in the room of a body, those that stay under its skin."""
    assert body.lumps is not None
    room = body.lumps.room
    axes = [np.arange(low, high + 1e-9, spacing) for low, high in zip(room.lower, room.upper, strict=True)]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return [
        pp.Lump(tuple(place.tolist()), radius, HARD)
        for radius in radii
        for place in places[room.hold(places, np.full(len(places), radius))]
    ]


def hidden_lump(place: tuple[float, float], size: float) -> pp.Lump:
    """Return the lump of a diameter in mm that lies under the cover below a place of the top."""
    top = block().base.body.geometry.size[2]  # type: ignore[attr-defined]  # it is a block
    return pp.Lump((*place, top - COVER - size / 2e3), size / 2e3, HARD)


@dataclass(frozen=True, eq=False)
class Felt:
    """Forces (…, P) of presses in N, and the deviation (…, P) of what a hand feels of them."""

    force: np.ndarray
    noise: np.ndarray

    @classmethod
    def of(cls, force: np.ndarray, astray: np.ndarray) -> Felt:
        """Return forces with a hand's noise; `astray` is their deviation by the doubt of the place, N."""
        return cls(force, np.hypot(np.where(force < LIGHT, FAINT, STRONG) * np.abs(force), astray))

    def row(self, i: int) -> Felt:
        """Return those of one body."""
        return Felt(self.force[i], self.noise[i])


def learnt_forces(
    body: Surrogate, lumps: Sequence[pp.Lump | None], X: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (H, P) along z of a learnt body with each lump, or none, and their deviation by 1 mm along x, y."""
    contrast, energy = body.lumps, body.hand_energy
    assert contrast is not None
    moved = ASTRAY * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    around = (X + moved[:, None]).reshape(-1, 3)
    forces = np.array(
        [contrast.answer(energy, [lump] if lump else [], around)[1][:, 2] for lump in lumps]
    ).reshape(len(lumps), 5, len(X))
    sides = (forces[:, 1::2] - forces[:, 2::2]) / 2.0
    return forces[:, 0], np.hypot(sides[:, 0], sides[:, 1])


@dataclass(frozen=True, eq=False)
class Observer:
    """The observer: what a hand would feel of the body without a lump, in row 0, and with each of H lumps."""

    expected: Felt  # (1 + H, P)

    def examine(
        self, truth: Felt, presses: int, rng: np.random.Generator, places: np.ndarray | None = None
    ) -> tuple[float, np.ndarray]:
        """Return the log of the mean likelihood ratio after so many presses, and the posterior (H,) of the lumps.

        `truth` (P,) is the body that is pressed. Each press is where the expected forces differ most for their noise;
        with `places` (H, q) of the lumps, where it takes most of the variance of the place of a lump that is there.
        """
        mean, noise = self.expected.force, self.expected.noise
        log = np.zeros(len(mean))
        for _ in range(presses):
            # no lump keeps half the weight: an observer who is sure too early would stop asking whether there is any
            lumps = (1.0 if places is not None else 0.5) * _normalise(log[1:])
            weight = np.concatenate([[1.0 - lumps.sum()], lumps])
            away = mean - weight @ mean
            spread, doubt = weight @ away**2, weight @ noise**2
            worth = spread / doubt
            if places is not None:
                covariance = (lumps[:, None] * (places - lumps @ places)).T @ away[1:]
                worth = (covariance**2).sum(axis=0) / (spread + doubt)
            log += self._likelihoods(truth, int(np.argmax(worth)), rng)
        return self._conclude(log)

    def examine_at_random(
        self, truth: Felt, presses: int, rng: np.random.Generator
    ) -> tuple[float, np.ndarray]:
        """Return the same numbers as `examine` after presses at random places."""
        drawn = rng.integers(self.expected.force.shape[1], size=presses)
        return self._conclude(sum(self._likelihoods(truth, int(press), rng) for press in drawn))

    def _likelihoods(self, truth: Felt, press: int, rng: np.random.Generator) -> np.ndarray:
        """Return the log likelihood (1 + H,) of what a hand feels in one press."""
        felt = truth.force[press] + truth.noise[press] * rng.normal()
        noise = self.expected.noise[:, press]
        return -0.5 * ((felt - self.expected.force[:, press]) / noise) ** 2 - np.log(noise)

    def _conclude(self, log: Any) -> tuple[float, np.ndarray]:
        """Return the log of the mean likelihood of lumps over that of none, and the posterior of the lumps."""
        most = log[1:].max()
        return float(most + np.log(np.exp(log[1:] - most).mean()) - log[0]), _normalise(log[1:])

    def share_above(self, truths: Felt, threshold: float, count: int, seed: int) -> float:
        """Return the share of examinations of bodies (T, P) in turn that end above a threshold."""
        rng, rows = np.random.default_rng(seed), [truths.row(i) for i in range(len(truths.force))]
        return float(
            np.mean([self.examine(rows[i % len(rows)], MOST, rng)[0] > threshold for i in range(count)])
        )

    def threshold(self, count: int) -> float:
        """Return the log that 5 % of examinations without a lump exceed."""
        rng, none = np.random.default_rng(0), self.expected.row(0)
        logs = [self.examine(none, MOST, rng)[0] for _ in range(count)]
        return float(np.quantile(logs, 1 - FALSE_ALARMS))


def solved_forces(X: np.ndarray) -> np.ndarray:
    """Return forces (1 + S, P) along z by finite elements, N: without a lump, and with one of each solved size.

    The lump lies below the middle of a square block: presses that mirror each other have the same force, solved once.
    """
    solver, lumps = block().open(), [hidden_lump(MIDDLE, size) for size in SOLVED]
    away = np.sort(np.abs(X[:, :2] - MIDDLE), axis=1).round(6)
    distinct, index = np.unique(away, axis=0, return_inverse=True)
    forces = np.full((1 + len(lumps), len(distinct)), np.nan)
    for p, offset in enumerate(distinct):
        print(f"press {p + 1} of {len(distinct)}", file=sys.stderr)
        free = solver.press((*(np.array(MIDDLE) - offset), X[0, 2]))
        changes = [solver.press_with(free, lump).force[2] for lump in lumps]
        forces[:, p] = free.response[2] + np.array([0.0, *changes])
    if np.isnan(forces).any():
        raise SolverError(
            f"{np.isnan(forces).sum()} presses of the examined block have no solution.",
            why="The body folds under the probe.",
            fix="Press less deep.",
        )
    return forces[:, index.ravel()]


def _normalise(log: np.ndarray) -> np.ndarray:
    """Return weights whose sum is one, of their logs."""
    weight = np.exp(log - log.max())
    return np.asarray(weight / weight.sum())


def sized_truths(body: Surrogate, X: np.ndarray, solved: np.ndarray) -> dict[float, dict[str, Felt]]:
    """Return what is pressed for each size of lump: the learnt body, and finite elements where they are solved.

    A lump below the least that was learnt adds what that adds, less by the cube of the sizes: its energy goes with its
    volume. Finite elements have the learnt slopes of the force along the surface.
    """
    assert body.lumps is not None
    plain, astray = (rows[0] for rows in learnt_forces(body, [None], X))
    least, truths = 2e3 * body.lumps.room.radius.low, {}
    for size in SIZES:
        lumps = [hidden_lump(place, max(size, least)) for place in (MIDDLE, BESIDE)]
        forces, doubts = learnt_forces(body, lumps, X)
        part = min(size / least, 1.0) ** 3
        doubts = astray + part * (doubts - astray)
        truths[size] = {"learnt body": Felt.of(plain + part * (forces - plain), doubts)}
        if size in SOLVED:
            truths[size]["finite elements"] = Felt.of(solved[[1 + SOLVED.index(size)]], doubts[:1])
    return truths


def tables(*, quick: bool = False) -> list[Table]:
    """Return what was found and how well it was located."""
    with tempfile.TemporaryDirectory() as folder:
        body = learnt_block(Path(folder), quick)
    X = lattice_of(block())
    X = X[:: 6 if quick else 1]
    return measure(body, X, solved_forces(X), quick)


def measure(body: Surrogate, X: np.ndarray, solved: np.ndarray, quick: bool) -> list[Table]:
    """Return the tables of a learnt body and the solved forces (1 + H, P) of the presses X (P, 3)."""
    count = EXAMINATIONS // 8 if quick else EXAMINATIONS
    observer = Observer(Felt.of(*learnt_forces(body, [None, *lumps_of(body, RADII, SPACING)], X)))
    threshold = observer.threshold(4 * count)
    none = observer.expected.row(0)
    alarms = observer.share_above(Felt(solved[:1], none.noise[None]), threshold, count, 1)
    truths = sized_truths(body, X, solved)
    rows = [
        {
            "truth": name,
            "size": size,
            "change": float(
                (felt.force / (solved[0] if name == "finite elements" else none.force) - 1).max()
            ),
            "found": observer.share_above(felt, threshold, count, int(size)),
        }
        for size, kinds in truths.items()
        for name, felt in kinds.items()
    ]
    learnt = np.array([truths[size]["learnt body"].force[0] for size in SOLVED])
    contrast = _contrast_errors(learnt - none.force, solved)
    share = next(row["found"] for row in rows if row["truth"] == "finite elements")
    assert body.lumps is not None
    return [
        Table(
            "find_lump",
            f"A lump of ten times the modulus under 10 mm of tissue, {MOST} presses{quick_mark(quick)}",
            [
                Column("truth", "what is pressed"),
                Column("size", "⌀ in mm", "g"),
                Column("change", "largest change of force", ".1%"),
                Column("found", "found", ".0%"),
            ],
            rows,
            [
                Claim(f"share of lumps of ⌀{SIZES[0]:g} mm that are missed", (1.0 - share,), 0.1, ".2f"),
                Claim("contrast error in these presses, 95th percentile", (contrast[1],), 0.12, ".3f"),
            ],
            [
                f"False alarms: {alarms:.1%} of examinations of the finite elements without a lump.",
                f"Fingertip: {solved[0].min():.2g} to {solved[0].max():.2g} N. Median contrast error in these presses: "
                f"{contrast[0]:.1%}; {body.lumps}.",
                "As context, people with silicone breasts: physicians found 87 % of lumps of 1.0 cm and 14 % of 0.3 cm "
                "(Fletcher et al. 1985, JAMA 253, 2224); in a later study 78 and 38 %.",
            ],
        ),
        _place_table(body, X, count, quick),
    ]


def _contrast_errors(changes: np.ndarray, solved: np.ndarray) -> tuple[float, float]:
    """Return the median and the 95th percentile of the error of learnt changes (S, P) over the solved ones."""
    wanted = solved[1:] - solved[0]
    counts = np.abs(wanted) > LEAST_CONTRAST * solved[0]
    median, p95 = np.quantile(np.abs(changes / wanted - 1)[counts], [0.5, 0.95])
    return float(median), float(p95)


def _place_table(body: Surrogate, X: np.ndarray, count: int, quick: bool) -> Table:
    """Return how well a lump of the learnt body is located by an observer who knows that there is one."""
    radius, rng = SIZES[0] / 2e3, np.random.default_rng(3)
    assert body.lumps is not None
    room = body.lumps.room
    depth = hidden_lump(MIDDLE, SIZES[0]).place[2]
    spots = rng.uniform(room.lower[:2], room.upper[:2], (HIDDEN, 2))
    hidden = [pp.Lump((float(x), float(y), depth), radius, HARD) for x, y in spots]
    lumps = lumps_of(body, (radius,), 0.003)
    finder = Observer(Felt.of(*learnt_forces(body, [None, *lumps], X)))
    truths, places = Felt.of(*learnt_forces(body, hidden, X)), np.array([lump.place for lump in lumps])[:, :2]
    ways = {
        "chosen by the variance of the place": lambda truth: finder.examine(truth, FEW, rng, places),
        "random": lambda truth: finder.examine_at_random(truth, FEW, rng),
    }
    rows = []
    for name, examine in ways.items():
        said = np.array([examine(truths.row(i % HIDDEN))[1] @ places for i in range(count)])
        errors = 1e3 * np.linalg.norm(said - spots[np.arange(count) % HIDDEN], axis=1)
        median, p95 = np.quantile(errors, [0.5, 0.95])
        rows.append({"presses": name, "median": float(median), "p95": float(p95)})
    return Table(
        "find_lump_place",
        f"Distance along the base of the place that is said from the lump's, {FEW} presses{quick_mark(quick)}",
        [
            Column("presses", "presses"),
            Column("median", "median, mm", ".1f"),
            Column("p95", "95th percentile, mm", ".1f"),
        ],
        rows,
        [],
        [
            f"Lumps of ⌀{SIZES[0]:g} mm under 10 mm of the learnt body, at {HIDDEN} places drawn from its room."
        ],
    )


def draw(path: Path) -> None:
    """Write a picture of the recorded detection over size."""
    from matplotlib import pyplot

    record = Record.read("find_lump")
    figure, axes = pyplot.subplots(figsize=(5.5, 3.4), layout="constrained")
    for name, mark in (("learnt body", "o-"), ("finite elements", "s")):
        points = [(float(row[1]), float(row[3].strip("%"))) for row in record.rows if row[0] == name]
        axes.plot(*zip(*points, strict=True), mark, label=f"ideal observer, {name}")
    sizes, shares = zip(*PUBLISHED, strict=True)
    axes.plot(sizes, [100 * share for share in shares], "^--", color="grey", label="people, silicone breasts")
    axes.axhline(100 * FALSE_ALARMS, color="grey", linewidth=0.8, linestyle=":")
    axes.set(xlabel="diameter of the lump, mm", ylabel="found, %", ylim=(0, 102))
    axes.legend()
    figure.savefig(path)
    pyplot.close(figure)


if __name__ == "__main__":  # the picture of the documentation
    draw(Path(sys.argv[1]))
