"""From solves of any physics to a field: mean, modes, and coefficients that follow from the inputs.

The modes are a proper orthogonal decomposition (Sirovich 1987) in the mean square over places; since they are
orthonormal there, the errors of their coefficients add up to the field's, and all coefficients are one target of
`palpate.fit`. What the modes miss is measured on solves that they were not made of, place by place, and together with
what the network missed of solves left out it sets the widths of the intervals.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import FitWarning, UsageError
from palpate.learning.arrays.fit import fit
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.arrays.input_bends import choose_bends
from palpate.learning.fields.decompose_field import SurfaceModes
from palpate.learning.folds import fold_masks
from palpate.options import FitOptions
from palpate.surrogates import AxisPlaces, MeshPlaces, ModalField
from palpate.units import Quantity, Range, bounds

__all__ = ["LearntModes", "learn_modes"]

_TOLERANCE = (
    1e-4  # of the solves' root mean square about their mean: the rest is below what coefficients miss
)
_MODES = 40  # at most: a picture of 20,000 nodes then takes 100 µs
_FOLDS = 10  # parts of the solves, of each of which modes of the others miss something
_ASKED = 1000  # inputs between the ends, of whose deviations the widths are made
# share of the weights by deviation in the mean with equal ones. Of six studies of 30 to 60 solves, 250 unseen cases
# each, nine tenths became 91 % in all (78 to 97); with 0 they became 93 % (83 to 98), with 1 87 % (73 to 97)
_SHIFTED = 0.5
_PLACES = 400  # places that set the widths and measure the error, spread evenly over all of them


@dataclass(frozen=True, eq=False)
class LearntModes:
    """A field, and how it was found.

    Attributes
    ----------
    field : ModalField
        The field, to be asked and kept.
    fitted : Fitted
        What `palpate.fit` made of the coefficients.
    errors : (J, p)
        Errors at p places of J solves that were left out, of networks and modes that had not seen them, root of the
        components' squares, in the field's unit.
    """

    field: ModalField
    fitted: Fitted
    errors: np.ndarray

    @property
    def relative(self) -> float:
        """95th percentile of the errors over the range of the field."""
        return float(self.field.meta["left_out_p95"] / self.field.meta["range"])

    def __str__(self) -> str:
        words, unit = self.field.meta, self.field.unit
        return (
            f"{self.field.name}: {words['modes']} modes miss {words['truncation_left_out']:.2g} {unit} of other "
            f"solves; 95 % of the values of solves left out are within {words['left_out_p95']:.2g} {unit}"
        ).replace(" ;", ";")

    __repr__ = __str__


def learn_modes(
    X: np.ndarray,
    values: np.ndarray,
    *,
    inputs: Sequence[Range],
    places: MeshPlaces | AxisPlaces,
    name: str,
    unit: str = "",
    components: Sequence[str] = (),
    modes_max: int = _MODES,
    bends: np.ndarray | None = None,
    options: FitOptions | None = None,
) -> LearntModes:
    """Learn a field at places from solves.

    Parameters
    ----------
    X : (N, n)
        Inputs of the solves, SI units; 20 solves at least.
    values : (N, P, C)
        The field at P places with C components.
    inputs : n ranges
        Names, units and ranges of the columns of X.
    places : MeshPlaces or AxisPlaces
        The P nodes or cells of a mesh, or points of an axis.
    name, unit : str
        What the field is called, and the SI unit of its values.
    components : sequence of str
        Names of the components; none of a scalar.
    modes_max : int
        Most modes.
    bends : (n,), optional
        Bends of the inputs' scales; by default `choose_bends` chooses them for this field.
    options : FitOptions, optional
        Of the search for the network of the coefficients.

    Returns
    -------
    LearntModes

    Raises
    ------
    UsageError
        If the field is the same in all solves, shapes disagree, or there are too few solves.
    """
    X, values = np.asarray(X, float), np.asarray(values, float)
    if values.ndim != 3 or values.shape[:2] != (len(X), len(places)):
        raise UsageError(
            f"The field {name!r} of shape {values.shape} does not fit {len(X)} solves at {places}.",
            fix="Give an array (solves, places, components).",
        )
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time and the bits of the result
        mean = values.mean(axis=0)
        offsets, shares = values - mean, np.full(len(places), 1.0 / len(places))
        size = float(np.sqrt((offsets**2).sum(axis=2).mean()))
        if not size > 0.0:
            raise UsageError(
                f"The field {name!r} is the same in all {len(X)} solves.", fix="Leave it out of the dataset."
            )
        every = SurfaceModes.of(offsets, shares)
        k = min(every.count(_TOLERANCE * size), modes_max)
        modes, missed = every.modes[:k], every.missed
        along = (offsets * shares[:, None]).reshape(len(X), -1) @ modes.reshape(k, -1).T
        left = _left_out_remainders(offsets, k)
        bends = choose_bends(X, [along], inputs) if bends is None else bends
    quantities = [Quantity(f"coefficient {i + 1}", unit) for i in range(k)]
    with warnings.catch_warnings():
        # that small coefficients are as good as not learnt is what they are made for
        warnings.simplefilter("ignore", FitWarning)
        fitted = fit(X, along, list(inputs), quantities, bends=bends, options=options or FitOptions())
    scatter = np.sqrt((left**2).mean(axis=0))
    errors, spread = _errors(fitted, along, modes, left)
    weights = _weights(fitted, inputs)
    widening = _widening(errors, np.sqrt(spread + _some(scatter[None]) ** 2), weights, fitted.level)
    sizes = np.sqrt((errors**2).sum(axis=2))
    meta = {
        "solves": len(X),
        "modes": k,
        "truncation": float(missed[k]) if k < len(missed) else 0.0,
        "truncation_left_out": float(np.sqrt((left**2).sum(axis=2).mean())),
        "left_out_p95": float(np.quantile(sizes, 0.95)),
        "range": float(np.ptp(values, axis=(0, 1)).max()),
    }
    coefficients = next(iter(fitted.surrogate().quantities.values()))
    parts = (coefficients, mean, modes, scatter, widening, tuple(components), meta)
    field = ModalField(name, unit, places, *parts, solved_at=X, solved=along)
    return LearntModes(field, fitted, sizes)


def _left_out_remainders(offsets: np.ndarray, count: int) -> np.ndarray:
    """Return what so many modes of other solves miss of each (N, P, C), all of a part of the solves left out at once.

    All that counts is in the span of the solves, so modes of the others are sought among their coefficients.
    """
    flat = offsets.reshape(len(offsets), -1)
    U, s, V = np.linalg.svd(flat, full_matrices=False)
    small, out = U * s, np.empty_like(U)
    for mask in fold_masks(np.arange(len(flat)), min(_FOLDS, len(flat))):
        middle = small[~mask].mean(axis=0)
        others, own = small[~mask] - middle, small[mask] - middle
        most = min(count, len(others) - 1)
        best = np.linalg.svd(others, full_matrices=False)[2][:most]
        out[mask] = own - own @ best.T @ best
    return np.asarray((out @ V).reshape(offsets.shape))


def _some(values: np.ndarray) -> np.ndarray:
    """Return values (N, P, C) at a few hundred places, spread evenly."""
    return values[:, :: max(1, math.ceil(values.shape[1] / _PLACES))]


def _errors(
    fitted: Fitted, along: np.ndarray, modes: np.ndarray, left: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return errors of solves left out and the variances that their coefficients were given, both (J, p, C)."""
    rows = fitted.comparison
    assert rows is not None
    assert rows.deviation is not None
    number = {row.tobytes(): i for i, row in enumerate(along)}
    pairs = [(j, number[row.tobytes()]) for j, row in enumerate(rows.measured) if row.tobytes() in number]
    judged, solves = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    some = _some(modes)
    missed = (rows.measured - rows.answered)[judged]
    errors = np.tensordot(missed, some, 1) + _some(left)[solves]
    return np.asarray(errors), np.asarray(np.tensordot(rows.deviation[judged] ** 2, some**2, 1))


def _weights(fitted: Fitted, inputs: Sequence[Range]) -> np.ndarray:
    """Return what each solve left out (J,) counts when widths are set; they add up to one.

    Solves at the border of what was solved are many, and left out they are extrapolated. As intervals are asked for
    inputs everywhere between the ends, each counts as often as such inputs have its stated deviation (the weights of a
    covariate shift, Tibshirani, Barber, Candès & Ramdas 2019). Of few solves these weights rest on a handful of them,
    so they are averaged with equal ones.
    """
    rows = fitted.comparison
    assert rows is not None
    assert rows.deviation is not None
    low, high = bounds(inputs)
    asked = np.random.default_rng(0).uniform(low, high, (_ASKED, len(low)))
    inside = fitted.trusted(asked)
    asked = asked[inside] if inside.any() else asked
    there = np.log((fitted.deviation(asked).reshape(len(asked), -1) ** 2).sum(axis=1))
    here = np.log((rows.deviation**2).sum(axis=1))
    nearest = np.abs(there[:, None] - here[None]).argmin(axis=1)
    # equal deviations share what falls to them
    _, own, number = np.unique(here, return_inverse=True, return_counts=True)
    each = np.bincount(own[nearest], minlength=len(number)) / number / len(asked)
    return np.asarray(_SHIFTED * each[own] + (1.0 - _SHIFTED) / len(here))


def _widening(errors: np.ndarray, deviation: np.ndarray, weights: np.ndarray, level: float) -> float:
    """Return what deviations are to be multiplied by, so that the intervals hold the share `level` of the errors.

    Not-a-number where so few solves were left out that no share of them would say it.
    """
    if len(errors) < 2 or len(weights) != len(errors):
        return math.nan
    scores = (np.abs(errors) / np.maximum(deviation, 1e-300)).reshape(len(errors), -1)
    each = np.repeat(weights / scores.shape[1], scores.shape[1])
    order = np.argsort(scores, axis=None)
    reached = np.cumsum(each[order])
    middle = scores.ravel()[order][np.searchsorted(reached, level * reached[-1])]
    return float(middle / NormalDist().inv_cdf((1.0 + level) / 2.0))
