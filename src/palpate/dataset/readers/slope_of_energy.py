"""Comparison of the responses of another solver with the slope of its energy: −∂U/∂input, by sign and size.

Between two cases i and j the energy falls by (r_i + r_j)·(c_j − c_i)/2, but for what the response curves in between.
Over pairs of near cases the ratio of both is 1; −1 is the force on the other body, a thousand is another unit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from palpate.dataset.schema import Field
from palpate.format import count, plain
from palpate.units import Range

__all__ = ["contradiction"]

_NEIGHBOURS = 8  # neighbours of a case, in the scale of the ranges
_MOST = 20_000  # pairs, which are enough to tell a factor
_SILENT = 10.0  # weight of an input without a response
_EVEN = 0.1  # least ratio of the responses at the ends of a pair
_FAR = 200  # cases whose pairs are all taken, where near ones say nothing
_PER_INPUT = 10  # cases for each input, with which a contradiction without a factor is told
_FEWEST = 6  # pairs that say something, and three of them for each input
_SURE = 0.6  # share of the energy's differences that a factor has to explain, to be believed
_TELLING = 0.9  # share that the signs of single inputs have to explain, to be believed
_EQUAL = 1.6  # ratio up to which two factors are the same: pairs far apart, and curved responses

_TIMES = {3: "a thousand times", -3: "a thousandth of", 6: "a million times", -6: "a millionth of"}
_CAUSES = {
    3: "an energy in mJ (N mm) that is read as J, or a response in kN that is read as N",
    -3: "inputs in mm that are read as m, a response in mN read as N, or an energy in J read as mJ",
    6: "an energy in µJ that is read as J",
    -6: "inputs in mm and a response in mN that are read as m and N",
    0: "an energy or a response of another part, such as of a half or quarter model, or other units",
}
_FAR_OFF = "inputs in mm that are read as m: they go farther than the body is large"


def contradiction(
    fields: Sequence[Field],
    answers: Mapping[str, np.ndarray],
    inputs: np.ndarray,
    ranges: Sequence[Range],
    extent: float,
) -> list[str]:
    """Return a warning where responses (case, n) and energies contradict each other, or a note where nobody can tell.

    `inputs` (case, n) are in SI units; `extent`, the largest length of the body in m, serves the likely cause.
    """
    name = next((n for n in ("potential_energy", "strain_energy") if n in answers), "")
    has_response = any(f.name == "response" and f.dims == ("input",) for f in fields)
    if not name or not has_response or (name == "strain_energy" and {r.unit for r in ranges} != {"m"}):
        return []
    silent, response, energy, rows = _of_touches(answers["response"], answers[name], inputs, ranges)
    inputs = inputs[rows]
    fall, work = _differences(inputs, response, energy, _pairs(inputs, ranges, silent))
    factor, explained = _factor(fall, work.sum(axis=1))
    signs = None if explained > _TELLING else _signs_of_each(fall, work)
    if not explained > _SURE and signs is None:  # noise is smaller than larger steps
        fall, work = _differences(inputs, response, energy, _all_pairs(min(len(energy), _FAR)))
        factor, explained = _factor(fall, work.sum(axis=1))
    if len(fall) < max(_FEWEST, 3 * len(ranges)):
        return [_no_verdict(name, len(rows))]
    if signs is not None:
        return [_axis_warning([r.name for r, sign in zip(ranges, signs, strict=True) if sign < 0], name)]
    if explained > _SURE:
        return _factor_warning(factor, explained, len(energy), name, inputs, ranges, extent)
    if len(energy) < _PER_INPUT * len(ranges) or silent.any():
        return [_no_verdict(name, len(rows))]
    return [
        f"Warning: energy and response contradict each other: no factor turns the slope −∂({name})/∂(input) into the "
        f"response ({100 * max(explained, 0):.0f} % of the differences follow). Likely cause: columns in another "
        "order, a body that remembers, or noise as large as the energy's differences."
    ]


def _of_touches(
    response: np.ndarray, energy: np.ndarray, inputs: np.ndarray, ranges: Sequence[Range]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return which inputs (n,) have no response, and of the cases that answer responses, energies and which they are.

    Cases in the air are left out: between one of them and a touch the mean response is no work over the way.
    """
    silent = ~(np.nan_to_num(response) != 0).any(axis=0)
    response = np.where(silent, 0.0, response)
    # a position may have no force, on a flat body without friction; a parameter's conjugate is not in the files
    units = {r.unit for r, without in zip(ranges, silent, strict=True) if not without}
    silent &= np.array([r.unit not in units for r in ranges])
    good = np.isfinite(inputs).all(axis=1) & np.isfinite(response).all(axis=1) & np.isfinite(energy)
    good &= (response != 0).any(axis=1)
    return silent, response[good], energy[good], good


def _no_verdict(name: str, cases: int) -> str:
    """Return the note of cases that neither confirm nor contradict."""
    return f"Whether response and {name} fit together can't be judged from these {count(cases, 'case')}."


def _axis_warning(turned: Sequence[str], name: str) -> str:
    """Return the warning of single inputs along which the response has another sign."""
    return (
        f"Warning: energy and response contradict each other: along {' and '.join(turned)} the response has another "
        f"sign than the slope −∂({name})/∂(input), along the others the same. Likely cause: an axis of the response "
        'that points the other way. Correct it in the mapping: "from", or the sign of that column in the file.'
    )


def _factor_warning(
    factor: float,
    explained: float,
    cases: int,
    name: str,
    inputs: np.ndarray,
    ranges: Sequence[Range],
    extent: float,
) -> list[str]:
    """Return a warning of a factor that is not 1, beyond what so many cases can tell."""
    size, spread = abs(factor), math.sqrt((1 / min(explained, 1.0) - 1) / max(cases - 1, 1))
    same = abs(math.log(size)) < math.log(_EQUAL) + 3 * spread
    if same and factor > 0:
        return []
    decade = 3 * round(math.log10(size) / 3)
    is_unit = decade in _TIMES and abs(math.log10(size) - decade) < math.log10(_EQUAL) + 3 * spread
    lengths = {r.unit for r in ranges} == {"m"}
    causes, faults = [], []
    if factor < 0:
        faults.append("has another sign than the response")
        causes.append("the force on the body in place of that on the probe" if lengths else "its sign")
    if not same:
        far = max(float(np.ptp(column)) for column in inputs.T)
        is_far = decade == -3 and is_unit and lengths and 0 < 30 * extent < far
        faults.append(f"is {_TIMES[decade] if is_unit else f'{plain(size, 2)} times'} the response")
        causes.append(_FAR_OFF if is_far else _CAUSES.get(decade if is_unit else 0, _CAUSES[0]))
    cure = "times = -1 for the response" if same else "its unit"
    return [
        f"Warning: energy and response contradict each other: the slope −∂({name})/∂(input) {' and '.join(faults)}. "
        f"Likely cause: {'; and '.join(causes)}. Correct it in the mapping: {cure}."
    ]


def _pairs(inputs: np.ndarray, ranges: Sequence[Range], silent: np.ndarray) -> np.ndarray:
    """Return pairs (p, 2) of near cases, which are nearest in the inputs (n,) that have no response."""
    from scipy.spatial import cKDTree

    if len(inputs) < 2:
        return np.empty((0, 2), dtype=int)
    scaled = inputs / np.array([r.high - r.low for r in ranges]) * np.where(silent, _SILENT, 1.0)
    near = cKDTree(scaled).query(scaled, k=min(_NEIGHBOURS + 1, len(inputs)))[1]
    pairs = np.stack([np.repeat(np.arange(len(inputs)), near.shape[1]), near.ravel()], axis=1)
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1), axis=0)
    return pairs if len(pairs) <= _MOST else np.random.default_rng(0).permutation(pairs)[:_MOST]


def _all_pairs(cases: int) -> np.ndarray:
    return np.stack(np.triu_indices(cases, 1), axis=1)


def _differences(
    inputs: np.ndarray, response: np.ndarray, energy: np.ndarray, pairs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much the energy falls (p,), and the work (p, n) of the mean responses, each input's apart.

    Pairs are left out whose two responses differ too much for their mean: the way between may lead through the air.
    """
    i, j = pairs.T
    way = inputs[j] - inputs[i]
    ends = np.stack([(response[k] * way).sum(axis=1) for k in (i, j)])
    even = (ends[0] * ends[1] > 0) & (np.abs(ends).min(axis=0) > _EVEN * np.abs(ends).max(axis=0))
    return (energy[i] - energy[j])[even], (0.5 * (response[i] + response[j]) * way)[even]


def _factor(fall: np.ndarray, work: np.ndarray) -> tuple[float, float]:
    """Return the factor between both whose squares are least, and the share of the fall's squares that it explains."""
    norms = float(work @ work), float(fall @ fall)
    if min(norms) <= 0:
        return 1.0, 0.0
    product = float(work @ fall)
    return product / norms[0], product**2 / (norms[0] * norms[1])


def _signs_of_each(fall: np.ndarray, work: np.ndarray) -> list[int] | None:
    """Return the sign of each input's share, where those signs alone explain the falls; else None."""
    if len(fall) < 3 * work.shape[1] or work.shape[1] > 4:
        return None
    for signs in itertools.product((1, -1), repeat=work.shape[1]):
        factor, explained = _factor(fall, work @ np.array(signs))
        if explained > _TELLING and 1 / _EQUAL < factor < _EQUAL and len(set(signs)) == 2:
            return list(signs)
    return None
