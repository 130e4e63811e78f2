"""Places at which every export is compared with palpate, and how large a difference may be.

One rule stands for C, FMU, ONNX and WebAssembly: of a quantity v at a place

    |Δ| ≤ least(1e-12 · condition, 1e-9) · (|v| + largest |v| over the places)        condition = Σ|w φ| / |Σ w φ|

the condition being that of ℓ, the sum of the network's terms. Single precision has a tolerance of its own, and the
deviation of the force, which goes out in single precision, too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from palpate.errors import AccuracyError
from palpate.export.field_tables import PROMISE, deepest_touches
from palpate.network import Network
from palpate.network.network_kernels import regressor_rows_into
from palpate.surrogates import FieldSurrogate, LearntEnergy, Surrogate
from palpate.surrogates.learnt_torque import ARM
from palpate.surrogates.moving_rest import MovingRest
from palpate.units import bounds

__all__ = [
    "ANSWERS",
    "Asker",
    "Comparison",
    "Difference",
    "ExportedFile",
    "Precision",
    "Releaser",
    "compare_body",
    "compare_field",
    "compare_rest",
    "condition",
    "difference",
    "places",
    "tolerances",
    "true_answers",
]

ANSWERS = 21  # numbers of an answer: its 19, the deviation, the flags
CONTACT, TRUSTED, NOT_A_NUMBER, TOO_DEEP = 1, 2, 4, 8
# relative errors: at condition 1, at most, and of the deviation
_TIGHT, _LOOSEST, _DEVIATION = 1e-12, 1e-9, 1e-5
_PARTS = {
    "energy": [0],
    "depth": [1],
    "force": [2, 3, 4],
    "amplitude": [15],
}
# the slope of the amplitude, and the stiffness of a body whose energy grows as s^(5/2)
_ROOTS = {"stiffness": list(range(5, 14)), "slope": [16, 17, 18]}
_ROUND_OFF = 1e-14  # m, depth that is round-off
_TOUCHES = 24  # places at which a field is compared, beside the deepest touches
_STROKE = 300  # steps of a memory's stroke
_HISTORIES, _PLACES = 24, 6  # histories after which a body is let go, and places of each


class Asker(Protocol):
    """An export that can be asked, and so compared."""

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p): a place, m, then parameters."""
        ...

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force (3), stored and lost energy of each step X (N, 1 + 3 + p): seconds, a place, parameters."""
        ...

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, nodes, components) for each row of X (N, 3 + p)."""
        ...


class Releaser(Asker, Protocol):
    """An export that also says where a body lies after a touch."""

    def release(self, x: np.ndarray, seconds: float) -> np.ndarray:
        """Return where (3,) the body lies, m, once it is let go for so long after `walk` at x (3 + p,)."""
        ...


@dataclass(frozen=True)
class Difference:
    """The largest difference of one quantity."""

    relative: float  # largest |Δ| over (|v| + largest |v|)
    allowed: float  # what that may be where it comes closest to it
    count: int  # numbers that were compared
    wrong: int  # how many are farther off than they may be


@dataclass(frozen=True)
class Comparison:
    """Differences of an export from palpate, by quantity; `single` for an export of single precision."""

    parts: Mapping[str, Difference] = field(default_factory=dict)
    single: bool = False

    @property
    def passed(self) -> bool:
        """True where no number is farther off than it may be."""
        return not any(part.wrong for part in self.parts.values())

    def __str__(self) -> str:
        words = [f"{name} {part.relative:.1e} (of {part.allowed:.0e})" for name, part in self.parts.items()]
        return "largest relative differences: " + ", ".join(words)

    def require(self, export: str, *, why: str, fix: str) -> None:
        """Refuse an export whose numbers are farther off than they may be; `export` names it."""
        if not self.passed:
            raise AccuracyError(f"{export} not answer as palpate does: {self}.", why=why, fix=fix)

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Return the differences by quantity, for JSON."""
        return {
            name: {"relative": part.relative, "tolerances": part.allowed, "count": part.count}
            for name, part in self.parts.items()
        }


@dataclass(frozen=True)
class ExportedFile:
    """A file that was written, and how far it is from palpate."""

    file: Path
    hash: str  # SHA-256 of the weights, as in every other export of the body
    # None where the program that runs it is missing, or nothing was to be compared
    comparison: Comparison | None

    def as_dict(self) -> dict[str, Any]:
        """Return what was written and compared, for JSON."""
        compared = {} if self.comparison is None else self.comparison.as_dict()
        size = self.file.stat().st_size
        return {"file": str(self.file), "bytes": size, "sha256": self.hash, "compared": compared}


@dataclass(frozen=True)
class Precision:
    """Precision of an export's numbers: `single` for 32 bits, where `tolerance` is relative to the largest value."""

    single: bool = False
    tolerance: float = 1e-2


def places(surrogate: Surrogate, count: int = 1000, seed: int = 0) -> np.ndarray:
    """Return places and parameters (N, 3 + p): inside, on the border, outside, at first contact, some not-a-number."""
    energy, rng = surrogate.hand_energy, np.random.default_rng(seed)
    low, high = bounds(energy.inputs)
    span, D, k = high - low, energy.baseline.directions, len(energy.baseline.directions)
    inner = rng.uniform(low, high, (count * 45 // 100, len(low)))
    border = rng.uniform(low, high, (count * 15 // 100, len(low)))
    side = rng.integers(0, len(low), len(border))
    rows = np.arange(len(border))
    border[rows, side] = np.where(rng.random(len(border)) < 0.5, low[side], high[side])
    outer = rng.uniform(low - 0.5 * span, high + 0.5 * span, (count * 22 // 100, len(low)))
    outer[:, k:] = np.clip(outer[:, k:], low[k:] - 0.1 * span[k:], high[k:] + 0.1 * span[k:])
    first = _first_contact(energy, rng.uniform(low, high, (count * 15 // 100, len(low))), rng)
    rest = count - len(inner) - len(border) - len(outer) - len(first)
    none = rng.uniform(low, high, (rest, len(low)))
    X = np.vstack([inner, border, outer, first, none])
    X = X if k == 3 else np.hstack([X[:, :k] @ D, X[:, k:]])
    last = np.arange(len(X) - rest, len(X))
    X[last, rng.integers(0, X.shape[1], rest)] = rng.choice([np.nan, np.inf, -np.inf], rest)
    return np.ascontiguousarray(X)


def _first_contact(energy: LearntEnergy, X: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Move probes to where they begin to touch, a little inside or outside of it; a pad to nearly no displacement."""
    surface, k = energy.baseline.surface, len(energy.baseline.directions)
    small = 10.0 ** rng.uniform(-9, -4, len(X)) * rng.choice([-1.0, 1.0], len(X))
    if surface is None:
        X[:, :k] *= small[:, None]
        return X
    for _ in range(8):
        distance, normal, _ = surface.at(X[:, :3])
        radius = distance + energy.depth(X)
        X[:, :3] += (radius - small - distance)[:, None] * normal
    return X


def condition(network: Network, X: np.ndarray) -> np.ndarray:
    """Return the largest Σ|w φ| / |Σ w φ| (N,) of a network's latent outputs at X (N, n), within its ranges."""
    low, high = bounds(network.inputs)
    Z = np.clip(X, low, high)
    work, steps, layout, scales, units, rows, _, constants = network.compiled()
    F = np.empty((len(Z), rows.shape[0]))
    regressor_rows_into(Z, F, work, steps, layout, scales, units, constants)
    size, total = np.abs(F) @ np.abs(rows), np.abs(F @ rows)
    return np.asarray(np.maximum(size / np.maximum(total, 1e-6 * size + 1e-300), 1.0).max(axis=1))


def tolerances(network: Network, X: np.ndarray, precision: Precision) -> np.ndarray:
    """Return the relative difference (N,) that outputs of a network may have at X (N, n)."""
    limit = np.minimum(_TIGHT * condition(network, X), _LOOSEST)
    return np.full(len(X), precision.tolerance) if precision.single else limit


def compare_body(
    surrogate: Surrogate,
    asker: Asker,
    precision: Precision | None = None,
    *,
    field: str = "",
    deviation: bool = True,
    partial: bool = False,
) -> Comparison:
    """Return how far an export is from palpate at 1,000 places, along a stroke of its memory, and in its field.

    Precision is double by default. `field` names the field that went out ("" for none), `deviation` says whether the
    posterior did. `partial` leaves out columns that the export answers by not-a-number throughout.
    """
    precision = precision or Precision()
    energy, X = surrogate.hand_energy, places(surrogate)
    wanted, got = true_answers(energy, X), asker.answers(X).copy()
    k = len(energy.baseline.directions)
    known = np.where(np.isfinite(X), X, 0.0)
    U = known if k == 3 else np.hstack([known[:, :3] @ energy.baseline.directions.T, known[:, 3:]])
    limit = np.minimum(_TIGHT * condition(energy.network, U), _LOOSEST)
    limit = np.full(len(X), precision.tolerance) if precision.single else limit
    deep = (np.nan_to_num(wanted[:, 20]).astype(int) & TOO_DEEP) > 0  # there the export says that it lets go
    surface = energy.baseline.surface
    if surface is not None:  # far away in the air the export's depth is only a level
        far = wanted[:, 1] < -0.0 - (surface.reach - _radii(energy, X)) * 0.999
        got[:, 1] = np.where(far & (got[:, 1] < 0), wanted[:, 1], got[:, 1])
    there = ~np.isnan(got).all(axis=0) | (not partial)
    parts = {
        name: difference(wanted[~deep][:, c], got[~deep][:, c], limit[~deep])
        for name, c in _PARTS.items()
        if there[c].all()
    }
    for name, c in _ROOTS.items():
        if there[c].all():
            parts[name] = _root_difference(energy, X, wanted, got, limit, deep, c)
    size = np.linalg.norm(np.nan_to_num(wanted[:, 2:5]), axis=1)
    if deviation and energy.root is not None:
        # relative to the force: nothing can be said where that is nearly none
        felt = ~deep & ((size == 0) | (size > (1e-3 if precision.single else 1e-7) * size.max()))
        felt &= ~(np.abs(wanted[:, 1]) < (1e-6 if precision.single else 1e-12))
        rough = np.full(felt.sum(), 1e-2 if precision.single else _DEVIATION)
        parts["deviation"] = difference(wanted[felt, 19:20], got[felt, 19:20], rough)
    if surrogate.torque_evaluator is not None and hasattr(asker, "torques"):
        parts["torque"] = _torques(surrogate, asker, X[~deep & np.isfinite(X).all(axis=1)], precision)
    parts["flags"] = _flags(energy, X, wanted, got, precision)
    if surrogate.memory is not None:
        parts |= _stroke(surrogate, asker, precision)
    if field:
        parts["field"] = compare_field(surrogate, surrogate.surface_fields[field], asker, precision)
    return Comparison(parts, precision.single)


def _torques(surrogate: Surrogate, asker: Any, X: np.ndarray, precision: Precision) -> Difference:
    """Compare the torque on a tool at finite places X (N, n)."""
    if (arm := surrogate.quantities.get(ARM)) is None:  # differences of energies
        limit = np.full(len(X), _LOOSEST)
    else:
        own = condition(arm.network, X) + condition(surrogate.hand_energy.network, X)
        limit = np.minimum(_TIGHT * own, _LOOSEST)
    limit = np.full(len(X), precision.tolerance) if precision.single else limit
    return difference(surrogate.torque(X), asker.torques(X), limit)


def true_answers(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    """Return what palpate answers, as `Asker.answers` does."""
    out, evaluate = np.empty((len(X), ANSWERS)), energy.evaluator()
    numbers = energy.baseline
    for row, x in zip(out, X, strict=True):
        row[19] = evaluate.trust(x[:3], x[3:])
        row[0], row[1], row[2:5], row[5:14] = (
            evaluate.energy,
            evaluate.depth,
            evaluate.force,
            evaluate.stiffness.ravel(),
        )
        row[14], row[15], row[16:19] = row[0] + numbers.offset, evaluate.amplitude, evaluate.slope
        if not np.isfinite(row[:19]).all():  # an export pushes nobody with what is no number
            row[2:14], row[20] = 0.0, NOT_A_NUMBER
            continue
        touching = numbers.holds or row[1] > 0
        own = numbers.radius_input
        radius = (numbers.radius if math.isfinite(numbers.radius) else 0.0) if own is None else x[own]
        row[20] = (
            CONTACT * touching + TRUSTED * evaluate.inside + TOO_DEEP * bool(row[1] > numbers.inner + radius)
        )
    return out


def _root_difference(
    energy: LearntEnergy,
    X: np.ndarray,
    wanted: np.ndarray,
    got: np.ndarray,
    limit: np.ndarray,
    deep: np.ndarray,
    columns: list[int],
) -> Difference:
    """Compare columns that go as a root of the depth s = R − d of a probe: see `_ROOTS`.

    Its condition at first contact is that of this difference, and where s itself is round-off nothing can be said.
    """
    s, chosen = wanted[:, 1], ~deep
    if energy.baseline.surface is not None:
        chosen = chosen & ~(np.abs(s) < _ROUND_OFF)
        of_depth = np.abs(2.0 * _radii(energy, X) - s) / np.maximum(np.abs(s), _ROUND_OFF)
        limit = np.maximum(limit, np.minimum(_TIGHT * np.nan_to_num(of_depth, nan=1.0), _LOOSEST))
    return difference(wanted[chosen][:, columns], got[chosen][:, columns], limit[chosen])


def _radii(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    own = energy.baseline.radius_input
    return np.full(len(X), energy.baseline.radius) if own is None else X[:, own]


def difference(wanted: np.ndarray, got: np.ndarray, limit: np.ndarray) -> Difference:
    """Compare columns (N, c) by the rule; what is not-a-number must be so in both."""
    known = np.isfinite(wanted)
    size = np.abs(np.where(known, wanted, 0.0)).max(initial=0.0)
    with np.errstate(invalid="ignore"):
        scale = np.where(known, np.abs(wanted), 0.0) + (size or 1.0)
        off = np.where(known, np.abs(got - wanted) / scale, 0.0)
    off = np.where(np.isnan(off), np.inf, off)
    unlike = known != np.isfinite(got)
    share = off / limit[:, None]
    worst = int(np.argmax(share)) if share.size else 0
    row = worst // max(1, share.shape[1])
    return Difference(
        float(off.max(initial=0.0)), float(limit[row]), int(off.size), int(((share > 1) | unlike).sum())
    )


def _flags(
    energy: LearntEnergy, X: np.ndarray, wanted: np.ndarray, got: np.ndarray, precision: Precision
) -> Difference:
    """Compare flags, but where rounding decides them: within 1e-11 of the border of what they tell (1e-4 if single)."""
    near = 1e-4 if precision.single else 1e-11
    span = np.ptp(np.array(bounds(energy.inputs)), axis=0)
    span = np.concatenate(
        [np.full(3, span[: len(energy.baseline.directions)].max()), span[len(energy.baseline.directions) :]]
    )
    rng = np.random.default_rng(1)
    steady = np.ones(len(X), dtype=bool)
    finite = np.isfinite(X).all(axis=1)
    for _ in range(8):
        moved = X[finite] * (1 + near * rng.choice([-1.0, 1.0], X[finite].shape))
        moved += near * span * rng.choice([-1.0, 1.0], moved.shape)
        steady[finite] &= true_answers(energy, moved)[:, 20] == wanted[finite, 20]
    off = steady & (wanted[:, 20] != got[:, 20])
    return Difference(float(off.mean()), 0.0, int(steady.sum()), int(off.sum()))


def _stroke(surrogate: Surrogate, asker: Asker, precision: Precision) -> dict[str, Difference]:
    """Compare along a stroke in and out and sideways, at uneven times."""
    energy, memory = surrogate.hand_energy, surrogate.memory
    assert memory is not None
    low, high = bounds(energy.inputs)
    D, k = energy.baseline.directions, len(energy.baseline.directions)
    t = np.linspace(0.0, 2.0 * np.pi, _STROKE)
    U = np.tile((low + high) / 2, (_STROKE, 1))
    many, turned = np.array([1.0, 2.0, 1.0])[-k:], np.array([0.3, 1.1, -np.pi / 2])[-k:]
    U[:, :k] += 0.5 * (high - low)[:k] * np.sin(many * t[:, None] + turned)
    dt = np.random.default_rng(2).uniform(0.0, 0.02, _STROKE)
    X = np.hstack([U[:, :k] @ D, U[:, k:]])
    evaluate, state = energy.evaluator(), memory.start()
    wanted = np.empty((_STROKE, 5))
    for row, x, step in zip(wanted, X, dt, strict=True):
        evaluate(x[:3], x[3:])
        state.step(x[:3].copy(), evaluate.amplitude, evaluate.slope, float(step))
        row[:3], row[3], row[4] = state.force, state.stored, state.lost
    got = asker.walk(np.ascontiguousarray(np.hstack([dt[:, None], X])))
    # what a step answers depends on all before it
    limit = np.full(_STROKE, precision.tolerance * 10 if precision.single else _LOOSEST / 10.0)
    return {
        "memory": difference(wanted[:, :3], got[:, :3], limit),
        "stored": difference(wanted[:, 3:], got[:, 3:], limit),
    }


def compare_rest(surrogate: Surrogate, export: Releaser) -> Difference:
    """Return how far the places are from palpate where a body lies that was led about and let go."""
    energy, memory, rng = surrogate.hand_energy, surrogate.memory, np.random.default_rng(3)
    assert memory is not None
    low, high = bounds(energy.inputs)
    D = energy.baseline.directions
    wanted, got = np.empty((_HISTORIES, 3)), np.empty((_HISTORIES, 3))
    for i, pause in enumerate(rng.uniform(0.0, 1.0, _HISTORIES)):
        U = rng.uniform(low, high, (_PLACES, len(low)))
        U[:, 1:] = U[-1, 1:]
        X, steps = np.hstack([U[:, :1] @ D, U[:, 1:]]), rng.uniform(0.0, 0.2, _PLACES)
        evaluate, state = energy.evaluator(), memory.start()
        moved = MovingRest(evaluate, state, D[0])
        for x, step in zip(X, steps, strict=True):
            evaluate(x[:3], x[3:])
            state.step(x[:3].copy(), evaluate.amplitude, evaluate.slope, float(step))
        moved.lies[:] = X[-1, :3]
        moved.release(float(pause), X[-1, 3:])
        wanted[i] = moved.lies
        export.walk(np.ascontiguousarray(np.hstack([steps[:, None], X])))
        got[i] = export.release(X[-1], float(pause))
    return difference(wanted, got, np.full(_HISTORIES, _LOOSEST / 10.0))


def compare_field(
    surrogate: Surrogate, shown: FieldSurrogate, asker: Asker, precision: Precision | None = None
) -> Difference:
    """Return how far the field of an export is from palpate, at places of `places` and at the deepest trained touches.

    The asker answers `shapes` of the field `shown`. Its modes were rounded: it may be off by 1e-4 of its largest value.
    """
    X = np.vstack([places(surrogate)[:_TOUCHES], deepest_touches(surrogate, shown)])
    X = X[(true_answers(surrogate.hand_energy, X)[:, 20].astype(int) & TOO_DEEP) == 0]
    wanted, got = shown.values(X), asker.shapes(X)
    limit = np.full(len(X), PROMISE if precision is None or not precision.single else 1e-3)
    return difference(wanted.reshape(len(X), -1), got.reshape(len(X), -1), limit)
